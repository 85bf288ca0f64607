//! Elements to exchange matrix.
