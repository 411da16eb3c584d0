# What a test under CTest needs: names <room>.<thing>.np<ranks>, the room as label, an environment in which Open MPI runs as
# root, in a container, and with more ranks than cores. A test that has nothing to run on exits 77 and counts as skipped.
set(REMAP_TEST_ENV
  OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
  OMPI_MCA_rmaps_base_oversubscribe=1 OMPI_MCA_mpi_yield_when_idle=1
  OMPI_MCA_hwloc_base_binding_policy=none # tests side by side would all sit on the first cores
  OMPI_MCA_btl_vader_single_copy_mechanism=none # containers forbid it
  OMPI_MCA_odls_base_sigkill_timeout=0 # mpiexec else sleeps a second after each program that fails, as many shall
  REMAP_SHARED_DATA=${REMAP_SHARED_DATA})
if(REMAP_LONG_TESTS)
  list(APPEND REMAP_TEST_ENV REMAP_LONG_TESTS=1)
endif()
if(REMAP_SANITIZE)
  list(APPEND REMAP_TEST_ENV
    LSAN_OPTIONS=suppressions=${PROJECT_SOURCE_DIR}/tests/support/lsan.supp:print_suppressions=0
    ASAN_OPTIONS=leak_check_at_exit=0:allocator_may_return_null=1 # rt.h asks for leaks before MPI_Finalize
    UBSAN_OPTIONS=print_stacktrace=1)
endif()

# remap_test_properties(<name> <room> <ranks> [TIMEOUT <seconds>]): what every test has in common.
function(remap_test_properties name room ranks)
  cmake_parse_arguments(PARSE_ARGV 3 T "" "TIMEOUT" "")
  if(NOT T_TIMEOUT)
    set(T_TIMEOUT 120)
  endif()
  if(REMAP_LONG_TESTS OR REMAP_SANITIZE)
    math(EXPR T_TIMEOUT "10 * ${T_TIMEOUT}")
  endif()
  set_tests_properties(${name} PROPERTIES LABELS "${room}" PROCESSORS ${ranks} TIMEOUT ${T_TIMEOUT}
    SKIP_RETURN_CODE 77 ENVIRONMENT "${REMAP_TEST_ENV}")
endfunction()

# remap_mpi_test(<room> <thing> <executable> [RANKS 1 2 ...] [TIMEOUT <seconds>] [ARGS ...]): one test per number of ranks.
function(remap_mpi_test room thing exe)
  cmake_parse_arguments(PARSE_ARGV 3 T "" "TIMEOUT" "RANKS;ARGS")
  if(NOT T_RANKS)
    set(T_RANKS 1)
  endif()
  foreach(n IN LISTS T_RANKS)
    set(name ${room}.${thing}.np${n})
    add_test(NAME ${name} COMMAND ${MPIEXEC_EXECUTABLE} ${MPIEXEC_NUMPROC_FLAG} ${n} ${MPIEXEC_PREFLAGS}
      $<TARGET_FILE:${exe}> ${MPIEXEC_POSTFLAGS} ${T_ARGS})
    remap_test_properties(${name} ${room} ${n} TIMEOUT ${T_TIMEOUT})
  endforeach()
endfunction()

# remap_test_program(<target> <file> <libraries...>): what programs that see the rooms have in common.
function(remap_test_program exe file)
  target_include_directories(${exe} PRIVATE ${PROJECT_SOURCE_DIR}/tests/support ${PROJECT_SOURCE_DIR}/libremap/src)
  target_compile_options(${exe} PRIVATE -fmacro-prefix-map=${PROJECT_SOURCE_DIR}/=) # short paths in messages
  target_link_libraries(${exe} PRIVATE ${ARGN} remap_static remap_warnings)
  set_property(GLOBAL APPEND PROPERTY REMAP_TEST_FILES ${file})
endfunction()

# remap_test(<room> <thing> [RANKS 1 2 3 4] [TIMEOUT <seconds>] [LIBS <targets>]): tests/<room>/test_<thing>.c as one program
# that sees the rooms' headers, and one CTest entry per number of ranks. room may be adapters/cgns.
function(remap_test room thing)
  cmake_parse_arguments(PARSE_ARGV 2 T "" "TIMEOUT" "RANKS;LIBS")
  string(REPLACE / _ exe test_${room}_${thing})
  add_executable(${exe} ${room}/test_${thing}.c)
  remap_test_program(${exe} ${room}/test_${thing}.c ${T_LIBS})
  remap_mpi_test(${room} ${thing} ${exe} RANKS ${T_RANKS} TIMEOUT ${T_TIMEOUT})
endfunction()

# remap_heap(<target>): a program of which one file includes heap.h.
function(remap_heap exe)
  target_link_options(${exe} PRIVATE -Wl,--wrap=malloc,--wrap=calloc,--wrap=realloc,--wrap=aligned_alloc,--wrap=free)
endfunction()

# remap_bench(<thing> [HEAP] [LIBS <targets>]): tests/bench/bench_<thing>.c as the program bench_<thing>, which CTest does not
# run. HEAP: it counts the memory that it and the library hold.
function(remap_bench thing)
  cmake_parse_arguments(PARSE_ARGV 1 T "HEAP" "" "LIBS")
  add_executable(bench_${thing} bench/bench_${thing}.c)
  remap_test_program(bench_${thing} bench/bench_${thing}.c ${T_LIBS})
  if(T_HEAP)
    target_compile_definitions(bench_${thing} PRIVATE BENCH_HEAP)
    remap_heap(bench_${thing})
  endif()
endfunction()

# remap_fuzz(<thing> COUNT <inputs> [RANKS 1 2 ...] [LIBS <targets>]): tests/fuzz/fuzz_<thing>.c as the program fuzz_<thing>.
# CTest lets it take every file of tests/fuzz/corpus/<thing> and so many inputs drawn by lot, with sanitizers two in five of
# these; with REMAP_FUZZERS it is run by hand.
function(remap_fuzz thing)
  cmake_parse_arguments(PARSE_ARGV 1 T "" "COUNT" "RANKS;LIBS")
  add_executable(fuzz_${thing} fuzz/fuzz_${thing}.c)
  remap_test_program(fuzz_${thing} fuzz/fuzz_${thing}.c ${T_LIBS})
  if(REMAP_FUZZERS)
    target_compile_definitions(fuzz_${thing} PRIVATE REMAP_LIBFUZZER)
    target_link_options(fuzz_${thing} PRIVATE -fsanitize=fuzzer)
  else()
    if(REMAP_SANITIZE)
      math(EXPR T_COUNT "2 * ${T_COUNT} / 5")
    endif()
    remap_mpi_test(fuzz ${thing} fuzz_${thing} RANKS ${T_RANKS} TIMEOUT 1000
      ARGS ${CMAKE_CURRENT_SOURCE_DIR}/fuzz/corpus/${thing} ${T_COUNT})
  endif()
endfunction()

# remap_script_test(<room> <thing> <command...>): a test that is a script.
function(remap_script_test room thing)
  add_test(NAME ${room}.${thing} COMMAND ${ARGN})
  remap_test_properties(${room}.${thing} ${room} 1)
endfunction()

# remap_tests_complete(): a test that fails if a file tests/**/test_*.c, bench_*.c or fuzz_*.c is named by no remap_test(),
# remap_bench() or remap_fuzz().
function(remap_tests_complete)
  get_property(named GLOBAL PROPERTY REMAP_TEST_FILES)
  list(JOIN named "\n" text)
  file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/named.txt "${text}\n")
  remap_script_test(rules every_test_file_is_named
    ${CMAKE_CURRENT_SOURCE_DIR}/rules/named.sh ${CMAKE_CURRENT_SOURCE_DIR} ${CMAKE_CURRENT_BINARY_DIR}/named.txt)
endfunction()
