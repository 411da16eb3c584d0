/* h5.h -- what h5_tree.c and h5_write.c share of HDF5; nobody else includes it. */
#ifndef REMAP_ADAPTERS_CGNS_H5_H
#define REMAP_ADAPTERS_CGNS_H5_H

#include "cgns_private.h"

#include <hdf5.h>

/* Let HDF5 print nothing about what fails in a statement. */
#define RC_QUIETLY(statement)    \
  do {                           \
    H5E_BEGIN_TRY { statement; } \
    H5E_END_TRY                  \
  } while (0)

/* The type in memory of values of a type of CGNS; below 0: there is none. */
hid_t rc_h5_type(const char *type);
/* Select values [lo, hi) of the box, counted along its own, in a dataset's space. false: HDF5 refuses. */
bool rc_h5_select(hid_t space, const rc_box *box, int64_t lo, int64_t hi);

#endif
