//! One program run to its end or to its limit: CPU and wall seconds, peak memory, bytes written.

use nix::sys::resource::{UsageWho, getrusage};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// What a run took.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Cost {
    /// Seconds of all cores, user and system.
    pub cpu_s: f64,
    /// Seconds on the clock.
    pub wall_s: f64,
    /// Most resident memory, by the stage's own report.
    pub peak_bytes: u64,
    /// Bytes of its main output.
    pub file_bytes: u64,
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq)]
pub enum End {
    /// Written: exit 0, or 3 where the asked tolerance was missed.
    Done(Cost),
    /// Stopped at the limit.
    OverBudget,
    /// Failed, with what it said.
    Failed(String),
}

/// CPU seconds of all children waited for so far.
fn children_cpu_s() -> f64 {
    let usage = getrusage(UsageWho::RUSAGE_CHILDREN).expect("the usage of one's own children");
    let seconds = |t: nix::sys::time::TimeVal| t.tv_sec() as f64 + 1e-6 * t.tv_usec() as f64;
    seconds(usage.user_time()) + seconds(usage.system_time())
}

/// Runs `command`, which writes `output`, for at most `limit` on the clock. Nothing else may run beside it, as the
/// operating system tells the CPU time of all children in one number.
pub fn measure(command: &mut Command, output: &Path, limit: Duration) -> End {
    let talk = tempfile::tempfile().expect("a temporary file");
    command.stdout(Stdio::null()).stderr(talk.try_clone().expect("a second handle"));
    let (before, start) = (children_cpu_s(), Instant::now());
    let mut child = command.spawn().unwrap_or_else(|e| panic!("{command:?}: {e}"));
    let status = loop {
        if let Some(status) = child.try_wait().expect("the child's state") {
            break status;
        }
        if start.elapsed() > limit {
            child.kill().expect("stopping the child");
            child.wait().expect("the child's end");
            return End::OverBudget;
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    let (wall_s, cpu_s) = (start.elapsed().as_secs_f64(), children_cpu_s() - before);
    if !matches!(status.code(), Some(0 | 3)) {
        use std::io::{Read, Seek};
        let (mut talk, mut said) = (talk, String::new());
        let _ = talk.rewind().and_then(|()| talk.read_to_string(&mut said));
        return End::Failed(said.lines().last().unwrap_or("no word").to_owned());
    }
    let file_bytes = output.metadata().map_or(0, |m| m.len());
    End::Done(Cost {
        cpu_s,
        wall_s,
        peak_bytes: report(output)["peak_memory_bytes"].as_u64().unwrap_or(0),
        file_bytes,
    })
}

/// The report beside an output.
pub fn report(output: &Path) -> serde_json::Value {
    let mut name = output.as_os_str().to_owned();
    name.push(".report.json");
    let text = std::fs::read_to_string(name).unwrap_or_default();
    serde_json::from_str(&text).unwrap_or(serde_json::Value::Null)
}
