"""How the types that pass between rooms stand in the HDF5 file of each stage."""
