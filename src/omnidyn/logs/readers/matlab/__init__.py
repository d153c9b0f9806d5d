"""MATLAB files: mat (the readers), mat5 (version 5 to 7, by scipy), hdf5 (version 7.3, and plain HDF5), variables (what
both find, to tables)."""
