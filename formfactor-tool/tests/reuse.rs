//! `--reuse`: elements that did not change keep their factors to the bit, rows state errors that hold, and an old matrix that will
//! not do is refused with its reason.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use common::{divided, meshed, room_with_box};
use interchange::matrix::Matrix;
use interchange::mesh::Mesh;
use interchange::provenance::Provenance;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Every how many elements one is divided in the second mesh.
const DIVIDED: usize = 7;

/// A room with a box on two meshes, the second of which has some elements divided in four; in a folder of their own.
struct Two {
    folder: tempfile::TempDir,
}

impl Two {
    fn new() -> Self {
        let two = Self { folder: tempfile::tempdir().unwrap() };
        let faces = room_with_box();
        let cells = |k: usize| divided(&faces[k..=k], 4).into_iter().map(move |cell| (k, cell));
        let first: Vec<_> = (0..faces.len()).flat_map(cells).collect();
        let second: Vec<_> = first
            .iter()
            .enumerate()
            .flat_map(|(k, (face, cell))| {
                let parts = if k % DIVIDED == 0 { 2 } else { 1 };
                divided(std::slice::from_ref(cell), parts).into_iter().map(|part| (*face, part))
            })
            .collect();
        two.write("first.mesh", &meshed(&faces, &first, 8));
        two.write("second.mesh", &meshed(&faces, &second, 8));
        two
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, mesh: &Mesh) {
        mesh.write(&self.path(name), Provenance::new("test", "1")).unwrap();
    }

    /// Runs `compute mesh -o output` with words that may be names of files in the folder.
    fn compute(&self, mesh: &str, output: &str, flags: &str) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_formfactor-tool"));
        command.current_dir(self.folder.path()).args(["compute", mesh, "-o", output]);
        command.args(flags.split_whitespace()).output().unwrap()
    }

    /// The same for the second mesh with the factors of `first.ff`.
    fn reusing(&self, output: &str, flags: &str) -> Output {
        let flags = format!("--reuse first.ff --reuse-mesh first.mesh {flags}");
        self.compute("second.mesh", output, &flags)
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap()
    }

    /// Elements of the first and the second mesh that are the same.
    fn same(&self) -> Vec<(usize, usize)> {
        let identities = |name: &str| Mesh::read(&self.path(name)).unwrap().0.element_identities();
        let first: HashMap<u64, usize> =
            identities("first.mesh").into_iter().enumerate().map(|(k, identity)| (identity, k)).collect();
        let second = identities("second.mesh").into_iter().enumerate();
        second.filter_map(|(k, identity)| Some((*first.get(&identity)?, k))).collect()
    }

    fn reused(&self, name: &str) -> u64 {
        let report = std::fs::read_to_string(self.path(&format!("{name}.report.json"))).unwrap();
        let report: serde_json::Value = serde_json::from_str(&report).unwrap();
        report["counters"]["pairs reused"].as_u64().unwrap()
    }
}

fn said(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

#[track_caller]
fn done(output: &Output) {
    assert_eq!(output.status.code(), Some(0), "{}", said(output));
}

/// All S_ij with both their places, row errors, areas.
fn dense(path: &Path) -> (Vec<Vec<f64>>, Vec<f64>, Vec<f64>) {
    let matrix = Matrix::open(path).unwrap();
    let n = matrix.element_count();
    let mut all = vec![vec![0.0; n]; n];
    matrix
        .for_each(|i, j, s| {
            all[i][j] = s;
            all[j][i] = s;
        })
        .unwrap();
    (all, matrix.row_errors().unwrap().to_vec(), matrix.areas().unwrap().to_vec())
}

#[test]
fn unchanged_elements_keep_their_factors_and_rows_state_their_errors() {
    let two = Two::new();
    done(&two.compute("second.mesh", "true.ff", "--tolerance 1e-9 --closure off"));
    let (truth, _, _) = dense(&two.path("true.ff"));
    let same = two.same();
    for (tolerance, old, new) in [
        ("0.05", "f32", "f32"),
        ("2e-3", "f32", "f32"),
        ("1e-5", "f32", "f64"),
        ("1e-5", "f64", "f32"),
        ("1e-6", "f64", "f64"),
    ] {
        let flags =
            |precision: &str| format!("--tolerance {tolerance} --precision {precision} --closure off");
        done(&two.compute("first.mesh", "first.ff", &flags(old)));
        done(&two.reusing("second.ff", &flags(new)));
        let (before, stated, _) = dense(&two.path("first.ff"));
        let (after, errors, areas) = dense(&two.path("second.ff"));
        let tolerance: f64 = tolerance.parse().unwrap();
        let kept = |i: usize| stated[i] <= 0.5 * tolerance;
        let mut pairs = 0;
        for &(i, k) in same.iter().filter(|(i, _)| kept(*i)) {
            for &(j, l) in same.iter().filter(|(j, _)| kept(*j)) {
                let old = if new == "f32" { f64::from(before[i][j] as f32) } else { before[i][j] };
                assert_eq!(after[k][l], old, "{tolerance}: {k} {l}");
                pairs += u64::from(k <= l);
            }
        }
        // Those that lie in a tile that is computed at all.
        let reused = two.reused("second.ff");
        assert!(reused > pairs / 3 && reused <= pairs, "{tolerance}: {reused} of {pairs}");
        for (i, row) in after.iter().enumerate() {
            let error: f64 = row.iter().zip(&truth[i]).map(|(s, t)| (s - t).abs()).sum::<f64>() / areas[i];
            assert!(error <= errors[i] + 1e-9, "{tolerance}: row {i}: {error:e}, stated {:e}", errors[i]);
            assert!(errors[i] <= tolerance, "{tolerance}: row {i}: {:e}", errors[i]);
        }
        for (&(i, k), stated) in same.iter().zip(same.iter().map(|(i, _)| stated[*i])) {
            assert!(!kept(i) || errors[k] >= stated, "{tolerance}: row {k} states less than its old part");
        }
    }
}

#[test]
fn threads_shards_and_files_of_the_old_matrix_change_nothing() {
    let two = Two::new();
    let flags = "--tolerance 2e-3 --closure report";
    done(&two.compute("first.mesh", "first.ff", flags));
    done(&two.reusing("whole.ff", flags));
    for threads in [1, 5] {
        done(&two.reusing("threads.ff", &format!("{flags} --threads {threads}")));
        assert!(two.bytes("threads.ff") == two.bytes("whole.ff"), "{threads} threads");
    }
    for part in 1..=3 {
        done(&two.reusing(&format!("{part}.ff"), &format!("{flags} --shard {part}/3")));
        done(&two.compute("first.mesh", &format!("first.{part}.ff"), &format!("{flags} --shard {part}/3")));
    }
    let tool = |words: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_formfactor-tool"));
        command.current_dir(two.folder.path()).args(words.split_whitespace()).output().unwrap()
    };
    done(&tool("merge 3.ff 1.ff 2.ff -o merged.ff"));
    assert!(two.bytes("merged.ff") == two.bytes("whole.ff"));
    // Shards are raw, whatever is to be done about closure when they are merged.
    let old = "--reuse first.2.ff first.1.ff first.3.ff --reuse-mesh first.mesh";
    done(&two.compute("second.mesh", "of_shards.ff", &format!("{old} {flags}")));
    done(&tool("compare of_shards.ff whole.ff --max 0"));
    let missing = two.compute("second.mesh", "x.ff", "--reuse first.2.ff --reuse-mesh first.mesh");
    assert_eq!(missing.status.code(), Some(1));
    assert!(said(&missing).contains("part 1, 3 is missing"), "{}", said(&missing));

    // The old files are named as inputs; without them, or with the skip off, everything is computed and nothing named.
    let inputs = |name: &str| Matrix::open(&two.path(name)).unwrap().provenance().inputs.len();
    assert_eq!((inputs("first.ff"), inputs("whole.ff")), (1, 3));
    done(&two.compute("second.mesh", "anew.ff", flags));
    done(&two.reusing("off.ff", &format!("{flags} --no-skip reuse")));
    assert!(two.bytes("off.ff") == two.bytes("anew.ff"));
    assert_eq!(two.reused("off.ff"), 0);
    let plan = two.reusing("x.ff", &format!("{flags} --dry-run"));
    let plan = String::from_utf8(plan.stdout).unwrap();
    let line = plan.lines().find(|line| line.trim_start().starts_with("reused")).unwrap();
    assert_eq!(line.split_whitespace().last().unwrap(), two.reused("whole.ff").to_string(), "{plan}");
}

#[test]
fn an_old_matrix_that_will_not_do_is_refused_with_its_reason() {
    let two = Two::new();
    let asked = "--tolerance 2e-3 --closure report";
    done(&two.compute("second.mesh", "anew.ff", asked));
    for (old, new, reason) in [
        ("--tolerance 2e-3", asked, "compute it with --closure off or report"),
        ("--tolerance 2e-3 --method area", asked, "compute it anew"),
        (
            "--tolerance 0.5 --closure off",
            "--tolerance 1e-4 --closure report",
            "too loose for single factors",
        ),
        (
            "--tolerance 2e-3 --closure off",
            "--tolerance 1.2e-3 --closure report --method area",
            "only --method auto",
        ),
    ] {
        two.compute("first.mesh", "first.ff", old);
        let output = two.reusing("second.ff", new);
        assert!(said(&output).contains("nothing is reused"), "{old}: {}", said(&output));
        assert!(said(&output).contains(reason), "{old}: {}", said(&output));
        assert_eq!(two.reused("second.ff"), 0);
        if new == asked {
            done(&output);
            assert!(two.bytes("second.ff") == two.bytes("anew.ff"), "{old}");
        }
    }

    // Another scene: the box is a little larger.
    done(&two.compute("first.mesh", "first.ff", asked));
    let mut other = Mesh::read(&two.path("second.mesh")).unwrap().0;
    other.vertices.last_mut().unwrap()[0] += 1e-12;
    two.write("other.mesh", &other);
    let output =
        two.compute("other.mesh", "x.ff", &format!("--reuse first.ff --reuse-mesh first.mesh {asked}"));
    assert!(said(&output).contains("the faces that block light differ"), "{}", said(&output));
    // A mesh that is not the old matrix's; an old matrix without its mesh; an output that is an input.
    let strange = two.compute("second.mesh", "x.ff", "--reuse first.ff --reuse-mesh second.mesh");
    assert_eq!(strange.status.code(), Some(1));
    assert!(
        said(&strange).contains("give --reuse-mesh the mesh that --reuse was computed for"),
        "{}",
        said(&strange)
    );
    assert_eq!(two.compute("second.mesh", "x.ff", "--reuse first.ff").status.code(), Some(2));
    assert_eq!(two.reusing("first.ff", asked).status.code(), Some(1));
}
