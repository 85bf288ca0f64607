//! Radiosity to pictures and points.
