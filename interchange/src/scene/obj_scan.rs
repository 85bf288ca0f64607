//! Scan of an OBJ file.
