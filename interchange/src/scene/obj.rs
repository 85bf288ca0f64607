//! The scene reader.
use super::Scene;
use crate::error::{Error, Result};
use std::path::Path;

pub(super) fn read(path: &Path, _two_sided: &[String]) -> Result<Scene> {
    Err(Error::whole(path, "not built yet"))
}
