/* stamp -- give CGNS files version 3.4, the newest that Debian's cgnscheck knows; what they hold is the same in 4.2.
 *
 *   ./stamp FILE ... */
#include <cgns_io.h>
#include <stdio.h>

int main(int argc, char **argv)
{
  const float version = 3.4f;

  for (int i = 1; i < argc; i++) {
    double root, node;
    int    file;

    if (cgio_open_file(argv[i], CGIO_MODE_MODIFY, CGIO_FILE_NONE, &file) || cgio_get_root_id(file, &root) ||
        cgio_get_node_id(file, root, "CGNSLibraryVersion", &node) || cgio_write_all_data(file, node, &version) ||
        cgio_close_file(file)) {
      fprintf(stderr, "stamp: %s cannot be changed\n", argv[i]);
      return 1;
    }
  }
  return 0;
}
