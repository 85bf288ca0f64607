//! Our own scan of OBJ text, in front of the parser: it alone knows lines, so it makes every check that a message
//! with a line depends on, and hands on a *normalised* text that holds nothing but `v x y z` and
//! `f i j k ...` with absolute indices. tobj 4.0.5 given the author's text would divide by a fourth coordinate,
//! split a group at every material change, lose unknown materials, take a continued line for two and, without saying
//! so, mix points and lines with the faces; the normalised text leaves it nothing to mistake.

use super::NONE;
use super::current::Current;
use super::statement::{Statement, UnknownKeywords, shown, statements};
use crate::error::{Error, Result};
use std::collections::HashSet;
use std::fmt::Write;
use std::path::Path;

/// Most vertices, and most corners of all faces together: indices are 32 bits wide, with room for what meshing adds.
const MOST: usize = 1 << 31;

/// Largest coordinate, 2^250 (about 1.8e75): squared areas are fourth powers of lengths, and 2^1000 is still finite.
const LARGEST_COORDINATE: f64 = f64::from_bits((1023 + 250) << 52);

/// Statements that carry nothing radiosity needs: texture and parameter vertices, normals, points, lines, display.
const SILENT: [&str; 22] = [
    "vt",
    "vn",
    "vp",
    "s",
    "p",
    "l",
    "mg",
    "lod",
    "bevel",
    "c_interp",
    "d_interp",
    "usemap",
    "maplib",
    "shadow_obj",
    "trace_obj",
    "ctech",
    "stech",
    "parm",
    "deg",
    "step",
    "bmat",
    "con",
];

/// Statements that carry surfaces which are not read: worth a warning of their own.
const UNSUPPORTED: [&str; 12] =
    ["surf", "curv", "curv2", "cstype", "trim", "hole", "scrv", "sp", "end", "fo", "call", "csh"];

/// What the scan found.
#[derive(Debug, Default)]
pub(super) struct Scan {
    /// Vertices and faces alone, for tobj.
    pub normalised: String,
    /// Vertices of the file.
    pub vertex_count: usize,
    /// Vertex numbers, from 0, of all faces' corners, face after face.
    pub corners: Vec<u32>,
    /// Faces in file order.
    pub faces: Vec<FaceAttributes>,
    /// Groups in order of first face.
    pub groups: Vec<String>,
    /// Materials in order of first face.
    pub materials: Vec<String>,
    /// Every name given to `usemtl`, with its first line.
    pub named_materials: Vec<(String, usize)>,
    /// What follows each `mtllib`, with its line.
    pub libraries: Vec<(String, usize)>,
    /// What the author should look at.
    pub warnings: Vec<String>,
}

/// What a face has besides its corners.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct FaceAttributes {
    /// Index into [`Scan::groups`].
    pub group: u32,
    /// Index into [`Scan::materials`].
    pub material: u32,
    /// Number of corners.
    pub corner_count: u32,
    /// Line it begins on, from 1.
    pub line: usize,
}

/// Scans and checks `text`, the contents of `path`.
pub(super) fn scan(path: &Path, text: &str) -> Result<Scan> {
    let mut scanner = Scanner::new(path);
    scanner.scan.normalised.reserve(text.len());
    for statement in statements(text) {
        scanner.take(&statement)?;
    }
    scanner.finish()
}

#[derive(Debug)]
struct Scanner<'p> {
    path: &'p Path,
    scan: Scan,
    group: Current,
    material: Current,
    named: HashSet<String>,
    before_any_material: usize,
    first_weight: Option<usize>,
    unsupported: Vec<(String, usize)>,
    unknown: UnknownKeywords,
}

impl<'p> Scanner<'p> {
    fn new(path: &'p Path) -> Self {
        Self {
            path,
            scan: Scan::default(),
            group: Current::default(),
            material: Current::default(),
            named: HashSet::new(),
            before_any_material: 0,
            first_weight: None,
            unsupported: Vec::new(),
            unknown: UnknownKeywords::default(),
        }
    }

    fn error(&self, line: usize, message: impl Into<String>) -> Error {
        Error::scene(self.path, line, message)
    }

    fn take(&mut self, statement: &Statement) -> Result<()> {
        match statement.keyword {
            "v" => self.vertex(statement),
            "f" => self.face(statement),
            "g" | "o" => {
                self.group.set(if statement.rest.is_empty() { NONE } else { &statement.rest });
                Ok(())
            }
            "usemtl" => self.use_material(statement),
            "mtllib" if statement.rest.is_empty() => Err(self
                .error(statement.line, "mtllib without a file name; name the MTL file or remove the line")),
            "mtllib" => {
                self.scan.libraries.push((statement.rest.to_string(), statement.line));
                Ok(())
            }
            word if SILENT.contains(&word) => Ok(()),
            word if UNSUPPORTED.contains(&word) => {
                if !self.unsupported.iter().any(|(told, _)| told == word) {
                    self.unsupported.push((word.to_owned(), statement.line));
                }
                Ok(())
            }
            _ => {
                self.unknown.note(statement);
                Ok(())
            }
        }
    }

    /// `v x y z`, with an optional weight, colour, or both, which are ignored.
    fn vertex(&mut self, statement: &Statement) -> Result<()> {
        let number = self.scan.vertex_count + 1;
        self.limit(statement.line, "vertices", number)?;
        self.scan.normalised.push('v');
        let mut count = 0;
        for word in statement.rest.split_whitespace() {
            let value: f64 = word.parse().map_err(|_| {
                let found = shown(word);
                self.error(statement.line, format!("vertex {number}: `{found}` is not a number"))
            })?;
            if let Some(axis) = ["x", "y", "z"].get(count) {
                self.check_coordinate(statement.line, number, axis, value)?;
                self.scan.normalised.push(' ');
                self.scan.normalised.push_str(word);
            } else if count == 3 {
                self.note_weight(statement, value);
            }
            count += 1;
        }
        self.scan.normalised.push('\n');
        self.scan.vertex_count = number;
        match count {
            3 | 4 | 6 | 7 => Ok(()),
            _ => {
                let expected = "expected x y z (then, if anything, a weight, a colour or both)";
                Err(self.error(statement.line, format!("vertex {number}: found {count} numbers, {expected}")))
            }
        }
    }

    fn check_coordinate(&self, line: usize, number: usize, axis: &str, value: f64) -> Result<()> {
        if !value.is_finite() {
            let message = format!("vertex {number}: {axis} is {value}; coordinates must be finite numbers");
            return Err(self.error(line, message));
        }
        if value.abs() > LARGEST_COORDINATE {
            let message = format!(
                "vertex {number}: {axis} is {value:e}; coordinates must stay below {LARGEST_COORDINATE:.1e} \
                 in size, or areas overflow; choose a larger unit of length"
            );
            return Err(self.error(line, message));
        }
        Ok(())
    }

    /// Four numbers, or seven, hold a weight; it belongs to free-form surfaces and means nothing to a polygon.
    fn note_weight(&mut self, statement: &Statement, value: f64) {
        if value != 1.0 && matches!(statement.rest.split_whitespace().count(), 4 | 7) {
            self.first_weight.get_or_insert(statement.line);
        }
    }

    /// `f v v v ...`, each `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn face(&mut self, statement: &Statement) -> Result<()> {
        let line = statement.line;
        let start = self.scan.corners.len();
        self.scan.normalised.push('f');
        for word in statement.rest.split_whitespace() {
            let vertex = self.corner(line, self.scan.corners.len() - start + 1, word)?;
            self.scan.corners.push(vertex);
            // Writing to a string cannot fail.
            let _ = write!(self.scan.normalised, " {}", u64::from(vertex) + 1);
        }
        self.scan.normalised.push('\n');
        let count = self.scan.corners.len() - start;
        self.limit(line, "corners of faces", self.scan.corners.len())?;
        if count < 3 {
            let message = format!("face with {count} corners, expected at least 3; complete or remove it");
            return Err(self.error(line, message));
        }
        if self.named.is_empty() {
            self.before_any_material += 1;
        }
        self.scan.faces.push(FaceAttributes {
            group: self.group.entry(),
            material: self.material.entry(),
            corner_count: count as u32,
            line,
        });
        Ok(())
    }

    /// Vertex number, from 0, that a word of a face names. Whether a later vertex exists is known only at the end.
    fn corner(&self, line: usize, ordinal: usize, word: &str) -> Result<u32> {
        let error = |message: String| self.error(line, format!("corner {ordinal} of the face: {message}"));
        let wrong = || error(format!("found `{}`, expected v, v/vt, v//vn or v/vt/vn", shown(word)));
        let mut parts = word.split('/');
        let vertex: i64 = parts.next().unwrap_or_default().parse().map_err(|_| wrong())?;
        let (texture, normal) = (parts.next().unwrap_or_default(), parts.next().unwrap_or_default());
        let is_index = |part: &str| part.is_empty() || part.parse::<i64>().is_ok();
        if parts.next().is_some() || !is_index(texture) || !is_index(normal) {
            return Err(wrong());
        }
        let count = self.scan.vertex_count;
        match vertex {
            0 => Err(error("vertex 0 does not exist; OBJ counts from 1".into())),
            1.. => u32::try_from(vertex - 1).map_err(|_| {
                error(format!("vertex {vertex} is out of range; a scene may have {MOST} vertices"))
            }),
            _ => u32::try_from(count as i64 + vertex).map_err(|_| {
                error(format!(
                    "vertex {vertex} is out of range; only {count} vertices stand before this line"
                ))
            }),
        }
    }

    fn use_material(&mut self, statement: &Statement) -> Result<()> {
        if statement.rest.is_empty() {
            let message = "usemtl without a name; name a material of the MTL file or remove the line";
            return Err(self.error(statement.line, message));
        }
        self.material.set(&statement.rest);
        if self.named.insert(statement.rest.to_string()) {
            self.scan.named_materials.push((statement.rest.to_string(), statement.line));
        }
        Ok(())
    }

    fn limit(&self, line: usize, what: &str, count: usize) -> Result<()> {
        if count <= MOST {
            return Ok(());
        }
        Err(self.error(line, format!("more than {MOST} {what}; split the scene into smaller files")))
    }

    /// Checks what only the whole file tells, and gathers the warnings.
    fn finish(mut self) -> Result<Scan> {
        if self.scan.faces.is_empty() {
            let (count, path) = (self.scan.vertex_count, self.path);
            let message =
                format!("the scene is empty: no faces ({count} vertices, no line that begins with `f`)");
            return Err(Error::whole(path, message));
        }
        let count = self.scan.vertex_count;
        let mut corners = self.scan.corners.as_slice();
        for face in &self.scan.faces {
            let (own, rest) = corners.split_at(face.corner_count as usize);
            if let Some(ordinal) = own.iter().position(|&vertex| vertex as usize >= count) {
                let message = format!(
                    "corner {} of the face: vertex {} is out of range; the file has {count} vertices",
                    ordinal + 1,
                    u64::from(own[ordinal]) + 1
                );
                return Err(self.error(face.line, message));
            }
            corners = rest;
        }
        self.scan.warnings = self.warnings();
        self.scan.groups = self.group.into_names();
        self.scan.materials = self.material.into_names();
        Ok(self.scan)
    }

    fn warnings(&self) -> Vec<String> {
        let path = self.path.display();
        let mut warnings = self.unknown.warnings(self.path);
        warnings.extend(self.unsupported.iter().map(|(word, line)| {
            format!(
                "{path}:{line}: `{word}` is not supported and ignored; convert free-form surfaces to polygons"
            )
        }));
        warnings.extend(
            self.first_weight.map(|line| {
                format!("{path}:{line}: a vertex has a weight other than 1; weights are ignored")
            }),
        );
        if self.before_any_material > 0 {
            let count = self.before_any_material;
            let line = self.scan.faces.first().map_or(1, |face| face.line);
            warnings.push(format!(
                "{path}:{line}: faces before any usemtl ({count}) are black and dark: they get the material {NONE}"
            ));
        }
        warnings
    }
}

#[cfg(test)]
mod tests;
