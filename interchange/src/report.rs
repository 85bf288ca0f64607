//! The report every stage leaves beside its output: `OUTPUT.report.json`, the same keys for all tools.

use crate::atomic_write;
use crate::error::Result;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// What a stage did, how long it took, what it skipped and how sure it is.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Report {
    /// Name of the tool.
    pub tool: String,
    /// Its version.
    pub version: String,
    /// Flags that changed the result.
    pub flags: Vec<String>,
    /// Wall seconds per phase, in order.
    pub phases: Vec<Phase>,
    /// Things counted: elements, pairs per class, everything skipped or repaired.
    pub counters: BTreeMap<String, u64>,
    /// Errors asked and achieved, energy terms, largest deviations.
    pub estimates: BTreeMap<String, f64>,
    /// What the user should look at.
    pub warnings: Vec<String>,
    /// Largest resident memory, bytes; 0 where the system does not tell.
    pub peak_memory_bytes: u64,
}

/// One phase of a stage.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Phase {
    /// Name.
    pub name: String,
    /// Wall seconds.
    pub seconds: f64,
}

impl Report {
    /// An empty report.
    pub fn new(tool: &str, version: &str) -> Self {
        Self {
            tool: tool.into(),
            version: version.into(),
            flags: Vec::new(),
            phases: Vec::new(),
            counters: BTreeMap::new(),
            estimates: BTreeMap::new(),
            warnings: Vec::new(),
            peak_memory_bytes: 0,
        }
    }

    /// Runs `work` and notes how long it took.
    pub fn phase<T>(&mut self, name: &str, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = work();
        self.phases.push(Phase { name: name.into(), seconds: start.elapsed().as_secs_f64() });
        result
    }

    /// Adds to a counter.
    pub fn count(&mut self, name: &str, amount: usize) {
        *self.counters.entry(name.into()).or_default() += amount as u64;
    }

    /// Notes an estimate.
    pub fn estimate(&mut self, name: &str, value: f64) {
        self.estimates.insert(name.into(), value);
    }

    /// Says a warning on stderr and keeps it.
    pub fn warn(&mut self, message: impl Into<String>) {
        let message = message.into();
        tracing::warn!("{message}");
        self.warnings.push(message);
    }

    /// Reads a report that a stage left.
    ///
    /// # Errors
    /// The file cannot be read, or is no report.
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|e| crate::Error::io(path, "read", e))?;
        let message = |e| format!("not a report ({e}); run the stage again that wrote it");
        serde_json::from_str(&text).map_err(|e| crate::Error::whole(path, message(e)))
    }

    /// Where the report of `output` lies: `s.ff.report.json` for `s.ff`.
    pub fn path_for(output: &Path) -> PathBuf {
        let mut name = output.as_os_str().to_owned();
        name.push(".report.json");
        name.into()
    }

    /// Writes the report beside `output`; standard output has no place beside it.
    pub fn write_beside(&mut self, output: &Path) -> Result<()> {
        if atomic_write::is_stdout(output) {
            return Ok(());
        }
        self.peak_memory_bytes = peak_memory_bytes();
        let path = Self::path_for(output);
        let mut text = serde_json::to_string_pretty(self)
            .map_err(|e| crate::Error::whole(&path, format!("the report cannot be written as JSON: {e}")))?;
        text.push('\n');
        atomic_write::write_bytes(&path, text.as_bytes()).map(|_| ())
    }
}

/// Peak resident memory of this process in bytes, as Linux tells it; 0 elsewhere.
pub fn peak_memory_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kibibytes = line.and_then(|rest| rest.trim().trim_end_matches("kB").trim().parse::<u64>().ok());
    kibibytes.unwrap_or(0) * 1024
}
