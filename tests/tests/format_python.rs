//! `interchange/FORMAT.md` is complete and true: the Python reader that stands in it reads what Rust writes, refuses what
//! is damaged, and the file shown there byte by byte is the file that is written.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use interchange::atomic_write::Partial;
use interchange::digest::Digest;
use interchange::materials::{Material, MaterialTable};
use interchange::matrix::{Matrix, MatrixRecord, MatrixWriter, PackedBlock, Precision};
use interchange::mesh::Mesh;
use interchange::provenance::Provenance;
use interchange::solution::Solution;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;
use tests::chain::{Chain, Stage};
use tests::two_squares::{self, Files};
use tests::{Run, Tolerance, assert_close, run};

/// serde_json's parser of decimal numbers may be off by an ulp or two.
const PARSED: Tolerance = Tolerance::Rel(4.0 * f64::EPSILON);

/// The code block of `FORMAT.md` in this language.
fn block(language: &str) -> String {
    let text = tests::text(&tests::root().join("interchange/FORMAT.md"));
    let (_, rest) = text.split_once(&format!("```{language}\n")).expect("a code block");
    rest.split_once("```").expect("the end of the code block").0.to_owned()
}

/// The reader of `FORMAT.md` as a program in `folder`.
fn reader(folder: &Path) -> PathBuf {
    let path = folder.join("reader.py");
    std::fs::write(&path, block("python")).unwrap();
    path
}

/// Runs the reader on a file. Without Python there is no test of the specification, so a missing one fails it.
fn read(reader: &Path, file: &Path) -> Run {
    let mut python = Command::new("python3");
    python.arg(reader).arg(file).env("PYTHONIOENCODING", "utf-8");
    let found = python.output();
    assert!(found.is_ok(), "python3 is needed to test FORMAT.md: {found:?}");
    run(&mut python)
}

fn json(reader: &Path, file: &Path) -> Value {
    let run = read(reader, file).expect_code(0);
    serde_json::from_str(&run.stdout).expect("JSON")
}

/// Compares all numbers of a JSON value, in order, with the expected ones.
#[track_caller]
fn assert_numbers(what: &str, value: &Value, expected: impl IntoIterator<Item = f64>) {
    fn flatten(value: &Value, into: &mut Vec<f64>) {
        match value {
            Value::Array(items) => items.iter().for_each(|item| flatten(item, into)),
            other => into.push(other.as_f64().unwrap_or_else(|| panic!("{other} is no number"))),
        }
    }
    let (mut got, expected) = (Vec::new(), expected.into_iter().collect::<Vec<_>>());
    flatten(value, &mut got);
    assert_eq!(got.len(), expected.len(), "{what}: {value}");
    for (i, (got, want)) in got.into_iter().zip(expected).enumerate() {
        assert_close(&format!("{what} {i}"), got, want, PARSED);
    }
}

/// Rows of different lengths, compared as their two sections.
#[track_caller]
fn assert_rows<T>(sections: &Value, starts: &str, values: &str, rows: (&[u32], &[T]), number: fn(&T) -> u32) {
    assert_numbers(starts, &sections[starts], rows.0.iter().map(|&x| x.into()));
    assert_numbers(values, &sections[values], rows.1.iter().map(|x| number(x).into()));
}

/// Compares everything the reader says of a mesh, a material table, a matrix and a solution with what Rust reads.
fn assert_same(reader: &Path, files: &Files) {
    assert_same_mesh(&json(reader, &files.mesh), &files.mesh);
    assert_same_materials(&json(reader, &files.materials), &files.materials);
    assert_same_matrix(&json(reader, &files.matrix), &files.matrix);
    assert_same_solution(&json(reader, &files.solution), &files.solution);
}

fn assert_same_mesh(got: &Value, path: &Path) {
    let (mesh, provenance, digest) = Mesh::read(path).unwrap();
    let sections = &got["sections"];
    assert_eq!(got["kind"], "mesh");
    assert_eq!(got["digest"], digest.to_string());
    assert_eq!(got["provenance"]["tool"], provenance.tool);
    assert_eq!(got["provenance"]["flags"], serde_json::json!(provenance.flags));
    for input in &provenance.inputs {
        assert_eq!(got["provenance"]["inputs"][&input.role], input.digest.to_string());
    }
    assert_eq!(got["record"]["elements"], mesh.element_count());
    assert_eq!(got["record"]["input_faces"], mesh.input_face_count);
    assert_numbers("vertices", &sections["vertices"], mesh.vertices.iter().flatten().copied());
    let rows = (mesh.elements.starts(), mesh.elements.values());
    assert_rows(sections, "element_starts", "element_corners", rows, |v| v.0);
    let rows = (mesh.element_nodes.starts(), mesh.element_nodes.values());
    assert_rows(sections, "element_node_starts", "element_nodes", rows, |n| n.0);
    let rows = (mesh.faces.starts(), mesh.faces.values());
    assert_rows(sections, "face_starts", "face_corners", rows, |v| v.0);
    let rows = (mesh.occluders.starts(), mesh.occluders.values());
    assert_rows(sections, "occluder_starts", "occluder_corners", rows, |v| v.0);
    let columns: [(&str, Vec<u32>); 8] = [
        ("element_faces", mesh.element_faces.iter().map(|f| f.0).collect()),
        ("element_sides", mesh.element_sides.clone()),
        ("node_vertices", mesh.node_vertices.iter().map(|v| v.0).collect()),
        ("face_inputs", mesh.face_inputs.clone()),
        ("face_groups", mesh.face_groups.iter().map(|g| g.0).collect()),
        ("face_materials", mesh.face_materials.iter().map(|m| m.0).collect()),
        ("face_flags", mesh.face_flags.clone()),
        ("occluder_faces", mesh.occluder_faces.iter().map(|f| f.0).collect()),
    ];
    for (name, values) in columns {
        assert_numbers(name, &sections[name], values.into_iter().map(f64::from));
    }
    let lines = mesh.lines.iter().flat_map(|l| [l.from.0, l.to.0, l.face.0, l.order, l.source.0]);
    assert_numbers("lines", &sections["lines"], lines.map(f64::from));
    let clusters = mesh.clusters.iter().flat_map(|c| [c.start, c.end, c.first_child, c.second_child]);
    assert_numbers("clusters", &sections["clusters"], clusters.map(f64::from));
    assert_eq!(sections["groups"], serde_json::json!(mesh.groups));
    assert_eq!(sections["materials"], serde_json::json!(mesh.materials));
}

fn assert_same_materials(got: &Value, path: &Path) {
    let (table, _, digest) = MaterialTable::read(path).unwrap();
    assert_eq!(got["kind"], "materials");
    assert_eq!(got["digest"], digest.to_string());
    assert_eq!(got["sections"]["names"], serde_json::json!(table.names));
    let numbers = |m: &Material| {
        let colours = [m.diffuse, m.radiance, m.specular, m.transmission].into_iter().flatten();
        let rest = [m.exponent, m.refraction, m.opacity, m.roughness, m.metalness, m.two_sided];
        colours.chain(rest).collect::<Vec<_>>()
    };
    assert_numbers("values", &got["sections"]["values"], table.values.iter().flat_map(numbers));
}

fn assert_same_matrix(got: &Value, path: &Path) {
    let matrix = Matrix::open(path).unwrap();
    let (sections, record) = (&got["sections"], matrix.record());
    assert_eq!(got["kind"], "matrix");
    assert_eq!(got["digest"], matrix.digest().to_string());
    assert_eq!(got["record"]["mesh"], record.mesh.to_string());
    assert_eq!(got["record"]["symmetric"], record.symmetric);
    assert_eq!(got["record"]["extended"], record.extended);
    assert_eq!(got["record"]["part"], record.part);
    assert_eq!(got["record"]["parts"], record.parts);
    assert_numbers("tolerance", &got["record"]["tolerance"], [record.tolerance]);
    assert_numbers("areas", &sections["areas"], matrix.areas().unwrap().iter().copied());
    assert_numbers("row_errors", &sections["row_errors"], matrix.row_errors().unwrap().iter().copied());
    let views = matrix.views().unwrap();
    let blocks = views.iter().map(|view| view.block).flat_map(|b| {
        let head = [b.row_start, b.rows, b.column_start, b.columns, b.code, b.rank].map(f64::from);
        head.into_iter().chain([b.offset as f64])
    });
    assert_numbers("blocks", &sections["blocks"], blocks);
    let values = views.iter().flat_map(|view| (0..view.values.len()).map(|i| view.values.get(i)));
    assert_numbers("values", &sections["values"], values);
    let structure: Vec<f64> = views.iter().flat_map(|view| view.structure).map(|&x| x.into()).collect();
    // Files of version 1.0 have no such section.
    assert_numbers("sparse", sections.get("sparse").unwrap_or(&Value::Array(Vec::new())), structure);
    // Sums in another order: a few ulp per term.
    let sums = matrix.row_sums().unwrap();
    assert_eq!(got["row_sums"].as_array().map(Vec::len), Some(sums.len()));
    for (i, sum) in sums.iter().enumerate() {
        let tolerance = Tolerance::Abs(4.0 * f64::EPSILON * sums.len() as f64);
        assert_close("row sum", got["row_sums"][i].as_f64().unwrap(), *sum, tolerance);
    }
}

fn assert_same_solution(got: &Value, path: &Path) {
    let (solution, _, origins, digest) = Solution::read(path).unwrap();
    assert_eq!(got["kind"], "solution");
    assert_eq!(got["digest"], digest.to_string());
    for (role, digest) in
        [("mesh", origins.mesh), ("matrix", origins.matrix), ("materials", origins.materials)]
    {
        assert_eq!(got["record"][role], digest.to_string(), "{role}");
    }
    assert_eq!(got["record"]["solver"], solution.summary.solver);
    assert_numbers("tolerance", &got["record"]["tolerance"], [solution.summary.tolerance]);
    assert_numbers("achieved", &got["record"]["achieved"], [solution.summary.achieved]);
    let columns = [
        ("radiosity", &solution.radiosity),
        ("irradiance", &solution.irradiance),
        ("history", &solution.history),
    ];
    for (name, values) in columns {
        assert_numbers(name, &got["sections"][name], values.iter().flatten().copied());
    }
    let details = &solution.details;
    let bounds = details.bounds.as_ref();
    for (name, values) in [
        ("exitance", details.exitance.as_ref()),
        ("unshot", details.unshot.as_ref()),
        ("lower", bounds.map(|[lower, _]| lower)),
        ("upper", bounds.map(|[_, upper]| upper)),
        ("element_errors", details.element_errors.as_ref()),
    ] {
        assert_eq!(got["sections"].get(name).is_some(), values.is_some(), "{name}");
        if let Some(values) = values {
            assert_numbers(name, &got["sections"][name], values.iter().flatten().copied());
        }
    }
    if let Some(row_sums) = &details.row_sums {
        assert_numbers("row_sums", &got["sections"]["row_sums"], row_sums.iter().copied());
    }
    if let Some(ambient) = &details.ambient {
        assert_numbers("ambient", &got["sections"]["ambient"], ambient.iter().copied());
    }
    if let Some(ranking) = &details.error_ranking {
        assert_numbers("error_ranking", &got["sections"]["error_ranking"], ranking.iter().map(|&i| i.into()));
    }
    if let Some(links) = &details.error_links {
        let numbers = links.iter().flat_map(|l| [l.first.into(), l.second.into(), l.error]);
        assert_numbers("error_links", &got["sections"]["error_links"], numbers);
    }
    if let Some(thermal) = &details.thermal {
        assert_numbers("thermal", &got["sections"]["thermal"], thermal.iter().flatten().copied());
    }
}

#[test]
fn python_reads_what_rust_writes() {
    let folder = tests::folder();
    let files = two_squares::write(folder.path());
    let reader = reader(folder.path());
    assert_same(&reader, &files);
    let mesh = json(&reader, &files.mesh);
    assert_eq!(mesh["sections"]["groups"][1], "lamp é");
    let matrix = json(&reader, &files.matrix);
    assert_numbers("row sums", &matrix["row_sums"], [two_squares::FORM_FACTOR; 2]);
}

#[test]
fn python_reads_what_the_tools_write() {
    let folder = tests::folder();
    let chain = Chain::new(tests::scene("cornell_blocks.obj"), folder.path(), 60);
    chain.run_all();
    let [mesh, materials, matrix, solution] =
        ["mesh", "materials", "ff", "sol"].map(|ending| chain.path(ending));
    let reader = reader(folder.path());
    assert_same(&reader, &Files { mesh, materials, matrix, solution });
    // What not every solution has.
    let optional = ["--bounds", "--snapshots=1", "--tolerance=0.1", "--solver=cg"];
    let done = run(chain.command_to(Stage::Solve, &chain.path("more.sol")).args(optional));
    assert!(matches!(done.code, Some(0 | 3)), "{}", done.stderr);
    assert_same_solution(&json(&reader, &chain.path("more.sol")), &chain.path("more.sol"));
    assert_same_solution(&json(&reader, &chain.path("more.000001.sol")), &chain.path("more.000001.sol"));
    // Faces as given: polygons with other counts of corners and nodes.
    let mut given = chain.clone();
    given.mesh_flags.clear();
    given.run_all();
    assert_same_mesh(&json(&reader, &given.path("mesh")), &given.path("mesh"));
}

/// The sparse block that FORMAT.md shows, and a sparse square on the diagonal between two full blocks.
#[test]
fn python_reads_sparse_blocks() {
    let folder = tests::folder();
    let path = folder.path().join("sparse.ff");
    let record = MatrixRecord {
        elements: 20,
        mesh: Digest::of(b"mesh"),
        precision: Precision::F64,
        symmetric: true,
        extended: false,
        tolerance: 1e-4,
        part: 0,
        parts: 1,
    };
    let partial = Partial::create(&path).unwrap();
    let areas: Vec<f64> = (1..=20).map(f64::from).collect();
    let mut writer = MatrixWriter::create(partial, Provenance::new("test", "1"), record, &areas).unwrap();
    let mut shown = [0.0; 20];
    (shown[3], shown[17]) = (0.25, 0.5);
    let mut square = [0.0; 36];
    (square[1], square[20]) = (0.125, 0.75);
    let mut sums = [0.0; 20];
    for (rows, columns, entries) in [
        (0..2, 0..2, &[0.0, 0.1, 0.0][..]),
        (2..6, 10..15, &shown),
        (8..16, 8..16, &square),
        (8..10, 18..20, &[0.2, 0.3, 0.4, 0.5]),
    ] {
        let triangle = rows == columns;
        let packed = PackedBlock::new(rows, columns, triangle, entries, Precision::F64, true);
        packed.view().for_each(|i, j, s| {
            sums[i] += s / areas[i];
            sums[j] += if i == j { 0.0 } else { s / areas[j] };
        });
        writer.push(&packed).unwrap();
    }
    let codes: Vec<u32> = writer.blocks().iter().map(|block| block.code).collect();
    assert_eq!(codes, [1, 2, 2, 0]);
    writer.finish(&[0.0; 20], &sums).unwrap();
    let got = json(&reader(folder.path()), &path);
    assert_same_matrix(&got, &path);
    let text = tests::text(&tests::root().join("interchange/FORMAT.md"));
    assert!(text.contains("the 7 items `0 1 1 1 2` `3 2`"));
    assert_eq!(got["sections"]["sparse"].as_array().unwrap()[..7], [0, 1, 1, 1, 2, 3, 2].map(Value::from));
    assert_numbers("stated row sums", &got["sections"]["row_sums"], sums.iter().copied());
    Matrix::open(&path).unwrap().check_row_sums().unwrap();
    // S(2, 13) over A of either.
    assert_numbers("row sum 2", &got["row_sums"][2], [0.25 / 3.0]);
}

#[test]
fn files_of_version_1_0_load() {
    let folder = tests::folder();
    let files = Files::in_folder(&tests::reference("format-1.0"));
    assert_eq!(Mesh::read(&files.mesh).unwrap().0, two_squares::mesh());
    assert_eq!(MaterialTable::read(&files.materials).unwrap().0, two_squares::materials());
    assert_eq!(Solution::read(&files.solution).unwrap().0, two_squares::solution());
    let matrix = Matrix::open(&files.matrix).unwrap();
    assert_eq!(matrix.views().unwrap()[0].values.get(0), two_squares::FORM_FACTOR);
    assert_same(&reader(folder.path()), &files);
}

#[test]
fn the_file_shown_byte_by_byte_is_the_file_written() {
    let folder = tests::folder();
    let files = two_squares::write(folder.path());
    assert_eq!(hexdump(&tests::bytes(&files.matrix)), block("hexdump"));
}

/// The bytes as `hexdump -C` shows them.
fn hexdump(bytes: &[u8]) -> String {
    let mut text = String::new();
    let mut starred = false;
    for (i, line) in bytes.chunks(16).enumerate() {
        let repeated = i > 0 && line.len() == 16 && line == &bytes[16 * (i - 1)..16 * i];
        if repeated {
            text += if starred { "" } else { "*\n" };
            starred = true;
            continue;
        }
        starred = false;
        let half = |part: &[u8]| part.iter().map(|b| format!("{b:02x}")).collect::<Vec<_>>().join(" ");
        let (left, right) = line.split_at(line.len().min(8));
        let letters: String =
            line.iter().map(|&b| if (32..127).contains(&b) { b.into() } else { '.' }).collect();
        text += &format!("{:08x}  {:23}  {:23}  |{letters}|\n", 16 * i, half(left), half(right));
    }
    text + &format!("{:08x}\n", bytes.len())
}

#[test]
fn python_refuses_what_is_damaged() {
    let folder = tests::folder();
    let files = two_squares::write(folder.path());
    reader(folder.path());
    let mut count = 0;
    for (seed, path) in files.all().into_iter().enumerate() {
        let good = tests::bytes(path);
        let cuts = tests::damage::cuts(good.len(), seed as u64);
        let cuts = cuts.into_iter().map(|cut| (cut, good[..cut].to_vec()));
        for (place, content) in tests::damage::flips(&good, 100, seed as u64).chain(cuts) {
            let kind = path.extension().unwrap().to_string_lossy();
            std::fs::write(folder.path().join(format!("{count:04}.{kind}.{place}.bad")), content).unwrap();
            count += 1;
        }
    }
    // One interpreter for all of them: it names those it takes.
    let program = "import glob, reader
for path in sorted(glob.glob('*.bad')):
    try:
        reader.read(path)
        print(path, 'is taken')
    except ValueError:
        print('refused')";
    let mut python = Command::new("python3");
    let run = run(python.args(["-c", program]).current_dir(folder.path())).expect_code(0);
    let taken: Vec<&str> = run.stdout.lines().filter(|line| *line != "refused").collect();
    assert_eq!(taken, [""; 0]);
    assert_eq!(run.stdout.lines().count(), count);
}
