"""MATLAB files: mat (the readers; version 7.3, and plain HDF5), mat5 (version 5 to 7, by scipy), variables (what both
find, to tables). hdf5: files of version 7.3."""
