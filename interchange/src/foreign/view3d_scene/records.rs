//! The lines of a View3D file.

use super::cut::Ring;
use super::placed::Placing;
use crate::error::{Error, Result};
use glam::DVec3;
use std::path::Path;

/// What a surface is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Exchanges radiation.
    Surface,
    /// Blocks it, and has no row in View3D's matrix.
    Obstruction,
    /// Blocks the view of a part of its base, which it looks at.
    Mask,
    /// Takes a part out of its base.
    Null,
}

/// A surface.
#[derive(Debug, Clone)]
pub(super) struct Record {
    pub(super) line: usize,
    pub(super) kind: Kind,
    /// Numbers of its points, from 0.
    pub(super) corners: Vec<u32>,
    /// Number of the surface that it lies in, from 1; 0 without.
    pub(super) base: usize,
    /// Number of the surface that it is combined with, from 1; 0 without.
    pub(super) combined: usize,
    pub(super) emittance: f64,
    pub(super) name: String,
}

/// A file's lines.
#[derive(Debug, Default)]
pub(super) struct Records {
    pub(super) titles: Vec<String>,
    pub(super) points: Vec<[f64; 3]>,
    pub(super) list: Vec<Record>,
    /// Whether View3D is asked for factors with reflections in them.
    pub(super) with_reflections: bool,
}

impl Records {
    pub(super) fn read(path: &Path, text: &str) -> Result<Self> {
        let mut records = Self::default();
        let mut reader = Reader { path, lines: text.lines().enumerate(), placed: false };
        while let Some((raw, line)) = reader.line() {
            let Some(kind) = line.words.first().and_then(|word| word.chars().next()) else { continue };
            match kind.to_ascii_uppercase() {
                // What follows the letter. Blanks of any alphabet may stand before it.
                'T' => records.titles.push(raw.trim_start().get(1..).unwrap_or_default().trim().to_owned()),
                'F' => reader.format(&line)?,
                'C' => {
                    let control = line.words[1..].join(" ").to_lowercase().replace(' ', "");
                    records.with_reflections |= control.contains("emit=1");
                }
                'V' => records.vertex(&reader, &line)?,
                'S' => records.surface(&mut reader, &line, Kind::Surface)?,
                'O' => records.surface(&mut reader, &line, Kind::Obstruction)?,
                'M' => records.surface(&mut reader, &line, Kind::Mask)?,
                'N' => records.surface(&mut reader, &line, Kind::Null)?,
                'E' | '*' => break,
                _ => {
                    let expected = "expected a line that begins with one of T C F V S O M N E !";
                    return Err(reader.wrong(&line, expected));
                }
            }
        }
        Ok(records)
    }

    /// The corners of a surface.
    pub(super) fn ring(&self, record: &Record) -> Ring {
        record.corners.iter().map(|&corner| DVec3::from_array(self.points[corner as usize])).collect()
    }

    fn vertex(&mut self, reader: &Reader<'_>, line: &Line<'_>) -> Result<()> {
        reader.in_sequence(line, self.points.len())?;
        let place = [2, 3, 4].map(|k| reader.float(line, k, "a coordinate"));
        let [x, y, z] = place;
        self.points.push([x?, y?, z?]);
        Ok(())
    }

    fn surface<'a>(&mut self, reader: &mut Reader<'a>, line: &Line<'a>, kind: Kind) -> Result<()> {
        reader.in_sequence(line, self.list.len())?;
        // Behind the number come four corners, or a letter for the shape.
        let corners = if reader.placed { Vec::new() } else { self.corners(reader, line)? };
        let next = if reader.placed { 3 } else { 6 };
        let mut record = Record {
            line: line.number,
            kind,
            corners,
            base: 0,
            combined: 0,
            emittance: 1.0,
            name: String::new(),
        };
        if kind != Kind::Obstruction {
            record.base = reader.integer(line, next)?;
            record.combined = reader.integer(line, next + 1)?;
            record.emittance = reader.float(line, next + 2, "an emittance from 0 to 1")?;
            let unnamed = || format!("surface {}", self.list.len() + 1);
            record.name = line.words.get(next + 3).map_or_else(unnamed, |name| (*name).to_owned());
        }
        if !(0.0..=1.0).contains(&record.emittance) {
            let message = format!("found {}, expected an emittance from 0 to 1", record.emittance);
            return Err(reader.wrong(line, message));
        }
        if record.combined > self.list.len() {
            let message = format!("combined with surface {}, which is not before it", record.combined);
            return Err(reader.wrong(line, message));
        }
        if record.base == 0 && matches!(kind, Kind::Mask | Kind::Null) {
            return Err(reader.wrong(line, "found base 0, expected the surface that this one lies on"));
        }
        if reader.placed {
            for corner in reader.shape(line)? {
                record.corners.push(self.points.len() as u32);
                self.points.push(corner.to_array());
            }
        }
        self.list.push(record);
        Ok(())
    }

    fn corners(&self, reader: &Reader<'_>, line: &Line<'_>) -> Result<Vec<u32>> {
        let mut corners = Vec::with_capacity(4);
        for k in 2..6 {
            match reader.integer(line, k)? {
                0 if k == 5 => {}
                v if (1..=self.points.len()).contains(&v) => corners.push(v as u32 - 1),
                v => return Err(reader.wrong(line, format!("found vertex {v} of {}", self.points.len()))),
            }
        }
        Ok(corners)
    }
}

/// The words of a line up to a comment.
struct Line<'a> {
    number: usize,
    words: Vec<&'a str>,
}

struct Reader<'a> {
    path: &'a Path,
    lines: std::iter::Enumerate<std::str::Lines<'a>>,
    /// Whether surfaces are given by place and shape (format 3a) in place of vertices.
    placed: bool,
}

impl<'a> Reader<'a> {
    /// The next line that is not a comment, as it stands and in words.
    fn line(&mut self) -> Option<(&'a str, Line<'a>)> {
        let (number, raw) = self.lines.find(|(_, line)| !line.trim_start().starts_with(['!', '/']))?;
        let data = raw.split('!').next().unwrap_or_default();
        let words = data.split(|c: char| c.is_whitespace() || c == ',').filter(|word| !word.is_empty());
        Some((raw, Line { number: number + 1, words: words.collect() }))
    }

    fn wrong(&self, line: &Line<'_>, message: impl Into<String>) -> Error {
        Error::scene(self.path, line.number, message)
    }

    fn format(&mut self, line: &Line<'_>) -> Result<()> {
        match line.words.get(1).map(|word| word.to_lowercase()).as_deref() {
            Some("3") => self.placed = false,
            Some("3a") => self.placed = true,
            found => {
                let found = found.unwrap_or("nothing");
                return Err(self.wrong(line, format!("found format {found}, expected 3 or 3a")));
            }
        }
        Ok(())
    }

    /// Corners of a shape by the numbers on the lines below it: place, azimuth and tilt, then width and height (`R`) or the
    /// corners in the shape's plane (`T`, `Q`).
    fn shape(&mut self, line: &Line<'a>) -> Result<Vec<DVec3>> {
        let letter = line.words.get(2).copied().unwrap_or("nothing");
        let flat = match letter.to_uppercase().as_str() {
            "R" => 2,
            "T" => 6,
            "Q" => 8,
            _ => return Err(self.wrong(line, format!("found shape {letter}, expected R, T or Q"))),
        };
        let mut numbers = Vec::with_capacity(5 + flat);
        while numbers.len() < 5 + flat {
            let Some((_, more)) = self.line() else {
                return Err(self.wrong(line, format!("the file ends where shape {letter} was expected")));
            };
            for k in 0..more.words.len() {
                numbers.push(self.float(&more, k, &format!("a number of shape {letter}"))?);
            }
        }
        let (place, flat) = numbers.split_at(5);
        let placing = Placing::new([place[0], place[1], place[2], place[3], place[4]]);
        let corners = match *flat {
            [width, height] => vec![[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]],
            _ => flat.as_chunks::<2>().0.to_vec(),
        };
        Ok(corners.into_iter().map(|[x, y]| placing.point(x, y)).collect())
    }

    fn integer(&self, line: &Line<'_>, k: usize) -> Result<usize> {
        let word = line.words.get(k).copied().unwrap_or("nothing");
        word.parse().map_err(|_| self.wrong(line, format!("found {word}, expected a whole number")))
    }

    fn float(&self, line: &Line<'_>, k: usize, expected: &str) -> Result<f64> {
        let word = line.words.get(k).copied().unwrap_or("nothing");
        let read = word.parse().ok().filter(|x: &f64| x.is_finite());
        read.ok_or_else(|| self.wrong(line, format!("found {word}, expected {expected}")))
    }

    /// Numbers must count from 1, as View3D wants them.
    fn in_sequence(&self, line: &Line<'_>, before: usize) -> Result<()> {
        let found = line.words.get(1).copied().unwrap_or("nothing");
        match found.parse::<usize>() {
            Ok(n) if n == before + 1 => Ok(()),
            _ => {
                let message = format!("found number {found}, expected {}: they count from 1", before + 1);
                Err(self.wrong(line, message))
            }
        }
    }
}
