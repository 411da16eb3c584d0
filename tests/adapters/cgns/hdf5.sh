#!/bin/sh
# Every HDF5 function that a program with the CGNS adapter calls must be bound to the parallel library: the serial one, which
# the CGNS library brings, has functions of the same names. hdf5.sh <program>
bound=$(nm -D "$1" | grep ' U H5') || { echo "$1 calls no HDF5 function"; exit 1; }
if echo "$bound" | grep SERIAL; then
  echo "$1 is bound to the serial HDF5"
  exit 1
fi
