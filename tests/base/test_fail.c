/* Reasons of failures, and the macros that carry statuses up. */
#include "base/base.h"
#include "rt.h"

static void first_reason_stays(void)
{
  rm_reason reason = {.side = -1, .global_cell = -1};

  RT_EQ(rm_fail(REMAP_BAD_MESH, &reason, REMAP_TARGET, 7, "face %d is open", 3), REMAP_BAD_MESH);
  RT_EQ(rm_fail(REMAP_INTERNAL, &reason, REMAP_SOURCE, 8, "later"), REMAP_INTERNAL);
  RT_STR(reason.text, "face 3 is open");
  RT_EQ(reason.side, REMAP_TARGET);
  RT_EQ(reason.global_cell, 7);
}

static void a_reason_may_be_absent(void)
{
  RT_EQ(rm_fail(REMAP_NO_MEMORY, NULL, -1, -1, "nobody reads this"), REMAP_NO_MEMORY);
}

static void long_text_is_cut(void)
{
  rm_reason reason = {.text = ""};

  rm_fail(REMAP_BAD_MESH, &reason, -1, -1, "%*d", 1000, 1);
  RT_EQ(strlen(reason.text), sizeof reason.text - 1);
}

static remap_status try_it(remap_status status, int *reached)
{
  RM_TRY(status);
  ++*reached;
  return REMAP_OK;
}

static remap_status go(remap_status first, int *cleaned)
{
  remap_status status;

  RM_GOTO(done, status = first);
  status = REMAP_COVERAGE;
done:
  ++*cleaned;
  return status;
}

static void try_returns_and_goto_cleans_up(void)
{
  int reached = 0, cleaned = 0;

  RT_EQ(try_it(REMAP_BAD_VALUE, &reached), REMAP_BAD_VALUE);
  RT_EQ(reached, 0);
  RT_EQ(try_it(REMAP_OK, &reached), REMAP_OK);
  RT_EQ(reached, 1);
  RT_EQ(go(REMAP_BAD_MESH, &cleaned), REMAP_BAD_MESH);
  RT_EQ(go(REMAP_OK, &cleaned), REMAP_COVERAGE);
  RT_EQ(cleaned, 2);
}

static void the_clock_goes_forward(void)
{
  const double begin = rm_seconds();

  RT_CHECK(rm_seconds() >= begin);
}

RT_MAIN(RT_CASE(first_reason_stays), RT_CASE(a_reason_may_be_absent), RT_CASE(long_text_is_cut),
        RT_CASE(try_returns_and_goto_cleans_up), RT_CASE(the_clock_goes_forward))
