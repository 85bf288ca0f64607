//! End-to-end tests of the radiosity pipeline.
