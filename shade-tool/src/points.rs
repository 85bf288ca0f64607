//! The table of points to probe: header `x,y,z,nx,ny,nz`, quoted by RFC 4180.

use crate::error::Result;
use glam::DVec3;
use interchange::Error;
use std::path::Path;

/// Columns of the table, in order.
pub const COLUMNS: [&str; 6] = ["x", "y", "z", "nx", "ny", "nz"];

/// A point of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct ProbePoint {
    /// The point.
    pub point: DVec3,
    /// Unit normal.
    pub normal: DVec3,
    /// The six numbers as they are written in the table.
    pub fields: Vec<String>,
}

/// Reads the table; errors name the line.
pub fn read(path: &Path) -> Result<Vec<ProbePoint>> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, "read", e))?;
    let mistake = |position: Option<&csv::Position>, message: String| {
        Error::scene(path, position.map_or(1, |position| line_of_record(&bytes, position)), message)
    };
    let unreadable = |error: csv::Error| match error.kind() {
        csv::ErrorKind::Utf8 { .. } => {
            mistake(error.position(), "not UTF-8 text, expected numbers with commas".into())
        }
        _ => mistake(error.position(), error.to_string()),
    };
    // A wrong number of fields is told below in the table's own words.
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).flexible(true).from_reader(bytes.as_slice());
    let header = reader.headers().map_err(unreadable)?;
    if header != COLUMNS.as_slice() {
        let found = header.iter().collect::<Vec<_>>().join(",");
        let message = format!("header \"{found}\", expected \"{}\"", COLUMNS.join(","));
        return Err(mistake(header.position(), message).into());
    }
    let mut points = Vec::new();
    for record in reader.records() {
        let record = record.map_err(unreadable)?;
        points.push(point(&record).map_err(|message| mistake(record.position(), message))?);
    }
    Ok(points)
}

/// Line, from 1, that a record stands on. The reader's own count is that of the empty lines it skipped before.
fn line_of_record(bytes: &[u8], position: &csv::Position) -> usize {
    let is_end_of_line = |byte: &&u8| matches!(byte, b'\r' | b'\n');
    let before = (position.byte() as usize).min(bytes.len());
    let start = before + bytes[before..].iter().take_while(is_end_of_line).count();
    1 + bytes[..start].iter().filter(|&&byte| byte == b'\n').count()
}

fn point(record: &csv::StringRecord) -> Result<ProbePoint, String> {
    if record.len() != COLUMNS.len() {
        return Err(format!("{} fields, expected the six {}", record.len(), COLUMNS.join(",")));
    }
    let mut values = [0.0_f64; 6];
    for ((value, field), column) in values.iter_mut().zip(record).zip(COLUMNS) {
        *value = field.parse().map_err(|_| format!("{column} is \"{field}\", expected a number"))?;
        if !value.is_finite() {
            return Err(format!("{column} is {field}, expected a finite number"));
        }
    }
    let [x, y, z, nx, ny, nz] = values;
    // Divided by its largest part first, so that squares neither vanish nor overflow.
    let normal = DVec3::new(nx, ny, nz);
    let normal = (normal / normal.abs().max_element()).try_normalize();
    let normal = normal.ok_or("the normal is zero, expected the direction that the plane looks")?;
    Ok(ProbePoint { point: DVec3::new(x, y, z), normal, fields: record.iter().map(str::to_owned).collect() })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn read_text(text: &str) -> Result<Vec<ProbePoint>> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.csv");
        std::fs::write(&path, text).unwrap();
        read(&path)
    }

    #[test]
    fn points_are_read_with_quotes_spaces_and_any_length_of_normal() {
        let points = read_text("x,y,z,nx,ny,nz\r\n1, 2.50,3e0,0,0,\"7\"\n\n0,0,0,1e-200,1e-200,0\n").unwrap();
        assert_eq!(points[0].point, DVec3::new(1.0, 2.5, 3.0));
        assert_eq!(points[0].normal, DVec3::Z);
        assert_eq!(points[0].fields, ["1", "2.50", "3e0", "0", "0", "7"]);
        assert!((points[1].normal.length() - 1.0).abs() < 1e-15);
        assert_eq!(read_text("x,y,z,nx,ny,nz\n").unwrap(), []);
    }

    #[test]
    fn mistakes_name_their_line() {
        for (text, line, word) in [
            ("", 1, "expected \"x,y,z,nx,ny,nz\""),
            ("x,y,z\n1,2,3\n", 1, "header \"x,y,z\""),
            ("x,y,z,nx,ny,nz,id\n", 1, "header"),
            ("x,y,z,nx,ny,nz\n0,0,0,0,1,0\n0,0,0,0,1\n", 3, "5 fields"),
            ("x,y,z,nx,ny,nz\n0,0,0,0,1,0,9\n", 2, "7 fields"),
            ("x,y,z,nx,ny,nz\n\n0,zero,0,0,1,0\n", 3, "y is \"zero\""),
            ("x,y,z,nx,ny,nz\n0,0,NaN,0,1,0\n", 2, "z is NaN"),
            ("x,y,z,nx,ny,nz\n0,0,0,0,inf,0\n", 2, "ny is inf"),
            ("x,y,z,nx,ny,nz\n0,0,0,0,-0,0\n", 2, "normal is zero"),
        ] {
            let message = read_text(text).unwrap_err().to_string();
            assert!(
                message.contains(&format!("p.csv:{line}: ")) && message.contains(word),
                "{text:?}: {message}"
            );
        }
    }
}
