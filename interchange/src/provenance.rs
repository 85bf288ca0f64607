//! Where a file comes from: the tool, the flags that change its result, the digests of what was read.
//! Never a path, a date or a thread count: the same inputs and flags give the same bytes anywhere.

use crate::digest::Digest;
use serde::{Deserialize, Serialize};

/// Origin of a file, stored in its header.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Provenance {
    /// Name of the tool that wrote the file.
    pub tool: String,
    /// Version of that tool.
    pub version: String,
    /// Flags that change the result, with their values, in a fixed order.
    pub flags: Vec<String>,
    /// What was read.
    pub inputs: Vec<Input>,
}

/// One input of a stage.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Input {
    /// What it served as: `scene`, `surfaces`, `mesh`, `matrix`, `materials`, `factors`, `reused matrix`,
    /// `reused mesh`.
    pub role: String,
    /// Identity: SHA-256 of a text file's bytes, or of a container's envelope and header.
    pub digest: Digest,
}

impl Provenance {
    /// Origin with flags and inputs still to be added.
    pub fn new(tool: &str, version: &str) -> Self {
        Self { tool: tool.into(), version: version.into(), flags: Vec::new(), inputs: Vec::new() }
    }

    /// Adds a flag that changes the result.
    pub fn flag(mut self, flag: impl Into<String>) -> Self {
        self.flags.push(flag.into());
        self
    }

    /// Adds an input.
    pub fn input(mut self, role: &str, digest: Digest) -> Self {
        self.inputs.push(Input { role: role.into(), digest });
        self
    }

    /// Digest of the input in this role, if there is one.
    pub fn digest_of(&self, role: &str) -> Option<Digest> {
        self.inputs.iter().find(|input| input.role == role).map(|input| input.digest)
    }
}
