//! Scene to elements.
