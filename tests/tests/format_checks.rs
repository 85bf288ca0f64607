//! What `interchange/FORMAT.md` marks as checked is refused although all checksums hold: a program of someone else's may
//! have written it. Each message names the file, the part and what was found.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use interchange::container::{Kind, Writer};
use interchange::digest::Digest;
use interchange::ids::{FaceId, GroupId, MaterialId, NodeId, VertexId};
use interchange::materials::MaterialTable;
use interchange::matrix::{self, Block, BlockKind, Matrix, MatrixRecord, Precision, Values};
use interchange::mesh::{Line, Mesh};
use interchange::provenance::Provenance;
use interchange::solution::{Origins, Solution};
use std::path::Path;
use tests::two_squares;

fn provenance() -> Provenance {
    Provenance::new("another program", "1")
}

/// The error of reading must name the file, the part and the finding.
#[track_caller]
fn assert_refused<T>(read: interchange::Result<T>, path: &Path, part: &str, found: &str) {
    let Err(error) = read else { panic!("{part}: {found}: was taken") };
    let message = error.to_string();
    for wanted in [path.to_str().unwrap(), part, found] {
        assert!(message.contains(wanted), "{wanted:?} is not in: {message}");
    }
}

#[test]
fn meshes_that_break_an_invariant_are_refused() {
    type Change = fn(&mut Mesh);
    let cases: [(&str, &str, Change); 16] = [
        ("elements", "none", |m| *m = Mesh { clusters: m.clusters.clone(), ..Mesh::default() }),
        ("vertices", "vertex 2 is not finite", |m| m.vertices[2][1] = f64::NAN),
        ("element_corners", "8 where fewer than 8", |m| {
            m.elements =
                [(0..4).map(VertexId).collect(), (5..9).map(VertexId).collect()].into_iter().collect();
        }),
        ("face_corners", "polygon 1 has fewer than 3", |m| {
            m.faces = [(0..4).map(VertexId).collect(), (4..6).map(VertexId).collect()].into_iter().collect();
        }),
        ("occluder_faces", "2 where fewer than 2", |m| m.occluder_faces[0] = FaceId(2)),
        ("node_vertices", "9 where fewer than 8", |m| m.node_vertices[0] = VertexId(9)),
        ("element_nodes", "5 nodes for 4 corners", |m| {
            m.element_nodes =
                [(0..5).map(NodeId).collect(), (4..8).map(NodeId).collect()].into_iter().collect();
        }),
        ("element_faces", "7 where fewer than 2", |m| m.element_faces[1] = FaceId(7)),
        ("element_sides", "2 where fewer than 2", |m| m.element_sides[1] = 2),
        ("face_groups", "2 where fewer than 2", |m| m.face_groups[1] = GroupId(2)),
        ("face_materials", "2 where fewer than 2", |m| m.face_materials[1] = MaterialId(2)),
        ("face_inputs", "2 where fewer than 2", |m| m.face_inputs[1] = 2),
        ("lines", "3 where fewer than 3", |m| {
            let line =
                Line { from: VertexId(0), to: VertexId(1), face: FaceId(0), order: 3, source: FaceId(1) };
            m.lines.push(line);
        }),
        ("clusters", "the root covers", |m| m.clusters[0].end = 1),
        ("clusters", "cluster 1 is empty", |m| {
            m.clusters[1].end = 0;
            m.clusters[2].start = 0;
        }),
        ("clusters", "do not tile", |m| m.clusters[0].second_child = 1),
    ];
    let folder = tests::folder();
    let path = folder.path().join("bad.mesh");
    for (part, found, change) in cases {
        let mut mesh = two_squares::mesh();
        change(&mut mesh);
        mesh.write(&path, provenance()).unwrap();
        assert_refused(Mesh::read(&path), &path, part, found);
    }
    // Counts of a section that differ from the header's.
    let mut mesh = two_squares::mesh();
    mesh.face_flags.push(0);
    mesh.write(&path, provenance()).unwrap();
    assert_refused(Mesh::read(&path), &path, "face_flags", "3 values");
}

#[test]
fn material_tables_out_of_range_are_refused() {
    let folder = tests::folder();
    let path = folder.path().join("bad.materials");
    for (reflectance, radiance) in
        [(1.5, 0.0), (-0.1, 0.0), (f64::NAN, 0.0), (0.5, -1.0), (0.5, f64::INFINITY)]
    {
        let mut table = two_squares::materials();
        table.values[1].diffuse[2] = reflectance;
        table.values[1].radiance[0] = radiance;
        table.write(&path, provenance()).unwrap();
        assert_refused(MaterialTable::read(&path), &path, "values", "material light");
    }
}

#[test]
fn matrices_that_break_an_invariant_are_refused() {
    let block = |kind, rows, columns, offset| Block::new(kind, rows, columns, offset);
    let dense = block(BlockKind::Dense, 0..1, 1..2, 0);
    let cases: [(&str, &str, Vec<Block>, Vec<f64>); 8] = [
        ("block 0", "row_start: 1", vec![block(BlockKind::Dense, 1..2, 0..1, 0)], vec![0.1]),
        ("block 0", "columns: 2", vec![block(BlockKind::Dense, 0..1, 1..3, 0)], vec![0.1, 0.1]),
        ("block 0", "column_start: 0", vec![block(BlockKind::Triangle, 1..2, 0..1, 0)], vec![0.1]),
        ("block 0", "offset 1", vec![Block { offset: 1, ..dense }], vec![0.1, 0.1]),
        ("block 0", "storage kind 3", vec![Block { code: 3, ..dense }], vec![0.1]),
        ("values", "2 entries", vec![dense], vec![0.1, 0.2]),
        ("values", "-0.1 at 0", vec![dense], vec![-0.1]),
        ("values", "NaN at 0", vec![dense], vec![f64::NAN]),
    ];
    let folder = tests::folder();
    let path = folder.path().join("bad.ff");
    let record = MatrixRecord {
        elements: 2,
        mesh: Digest::of(b"mesh"),
        precision: Precision::F64,
        symmetric: true,
        extended: false,
        tolerance: 1e-4,
        part: 0,
        parts: 1,
    };
    let write = |record: &MatrixRecord, blocks: &[Block], values: &[f64], areas: &[f64], errors: &[f64]| {
        matrix::write(&path, provenance(), record.clone(), blocks, Values::F64(values), areas, errors)
            .unwrap();
        Matrix::open(&path)
    };
    for (part, found, blocks, values) in cases {
        let opened = write(&record, &blocks, &values, &[1.0, 1.0], &[0.0, 0.0]);
        assert_refused(opened, &path, part, found);
    }
    for (part, found, areas, errors) in [
        ("areas", "0 at 1", [1.0, 0.0], [0.0, 0.0]),
        ("areas", "inf at 0", [f64::INFINITY, 1.0], [0.0, 0.0]),
        ("row_errors", "-1 at 1", [1.0, 1.0], [0.0, -1.0]),
        ("row_errors", "NaN at 0", [1.0, 1.0], [f64::NAN, 0.0]),
    ] {
        assert_refused(write(&record, &[dense], &[0.1], &areas, &errors), &path, part, found);
    }
    assert_refused(write(&record, &[dense], &[0.1], &[1.0], &[0.0, 0.0]), &path, "areas", "1 values");
    for (found, changed) in [
        ("part 2 of 2; part 1 is missing", MatrixRecord { part: 1, parts: 2, ..record.clone() }),
        ("part 0 of 0", MatrixRecord { parts: 0, ..record.clone() }),
        ("extended true", MatrixRecord { extended: true, ..record.clone() }),
    ] {
        let opened = write(&changed, &[dense], &[0.1], &[1.0, 1.0], &[0.0, 0.0]);
        assert_refused(opened, &path, "header", found);
    }
    write(&record, &[dense], &[0.1], &[1.0, 1.0], &[0.0, 0.0]).expect("the unchanged one is taken");

    // Without symmetry blocks may lie anywhere, but half a square means nothing.
    let one_way = MatrixRecord { symmetric: false, ..record.clone() };
    let below = Block { row_start: 1, column_start: 0, ..dense };
    let both = [dense, Block { offset: 1, ..below }];
    let matrix = write(&one_way, &both, &[0.1, 0.3], &[1.0, 1.0], &[0.0, 0.0]).expect("blocks on both sides");
    assert_eq!(matrix.row_sums().unwrap(), [0.1, 0.3]);
    let triangle = Block::new(BlockKind::Triangle, 0..2, 0..2, 0);
    let opened = write(&one_way, &[triangle], &[0.0, 0.1, 0.0], &[1.0, 1.0], &[0.0, 0.0]);
    assert_refused(opened, &path, "block 0", "dense blocks");
}

#[test]
fn sparse_blocks_that_break_an_invariant_are_refused() {
    let folder = tests::folder();
    let path = folder.path().join("bad.ff");
    let record = MatrixRecord {
        elements: 6,
        mesh: Digest::of(b"mesh"),
        precision: Precision::F64,
        symmetric: true,
        extended: false,
        tolerance: 1e-4,
        part: 0,
        parts: 1,
    };
    let write = |blocks: &[Block], values: &[f64], structure: &[u32]| {
        Writer::new(Kind::Matrix)
            .section("blocks", blocks)
            .section("areas", &[1.0; 6])
            .section("row_errors", &[0.0; 6])
            .section("values", values)
            .section("sparse", structure)
            .write(&path, provenance(), record.clone())
            .unwrap();
        Matrix::open(&path)
    };
    let above = |entries| Block::sparse(0..2, 2..6, entries, 0);
    let square = |entries| Block::sparse(1..3, 1..3, entries, 0);
    let cases: [(&str, Block, usize, &[u32]); 10] = [
        ("row starts", above(2), 2, &[1, 1, 2, 0, 3]),
        ("row starts", above(2), 2, &[0, 2, 1, 0, 3]),
        ("row starts", above(2), 2, &[0, 1, 1, 0, 3]),
        ("row starts", above(2), 2, &[0, 3, 2, 0, 3]),
        ("columns of row 0", above(2), 2, &[0, 2, 2, 3, 3]),
        ("columns of row 1", above(2), 2, &[0, 1, 2, 0, 4]),
        ("columns of row 1", square(2), 2, &[0, 1, 2, 0, 0]),
        ("row_start: 1", Block::sparse(1..3, 2..6, 2, 0), 2, &[0, 1, 2, 0, 1]),
        ("4 items", above(2), 2, &[0, 1, 2, 0]),
        ("2 entries", above(1), 2, &[0, 1, 1, 0]),
    ];
    for (found, block, entries, structure) in cases {
        assert_refused(write(&[block], &vec![0.1; entries], structure), &path, "", found);
    }
    write(&[above(2)], &[0.1, 0.1], &[0, 1, 2, 0, 3]).expect("good sparse rows are taken");
    write(&[square(2)], &[0.1, 0.1], &[0, 1, 2, 1, 1]).expect("a good sparse square is taken");
    // A number of entries that is no more than a claim.
    assert_refused(write(&[above(u32::MAX)], &[], &[0, 0, 0]), &path, "values", "0 entries");
}

#[test]
fn solutions_that_are_not_finite_are_refused() {
    let folder = tests::folder();
    let path = folder.path().join("bad.sol");
    let digest = Digest::of(b"any");
    let origins = Origins { mesh: digest, matrix: digest, materials: digest };
    let mut solution = two_squares::solution();
    solution.irradiance[1][2] = f64::INFINITY;
    solution.write(&path, provenance(), origins).unwrap();
    assert_refused(Solution::read(&path), &path, "irradiance", "at 1");
    let mut solution = two_squares::solution();
    solution.irradiance.pop();
    solution.write(&path, provenance(), origins).unwrap();
    assert_refused(Solution::read(&path), &path, "irradiance", "1 values");
}
