//! The measured error of a run: irradiance at points, the picture, rows of the matrix.

use crate::programs::{Run, run, tool};
use crate::table::Table;
use serde_json::Value;
use shade_tool::exr_reader::StoredPicture;
use shade_tool::picture::Picture;
use std::path::Path;

/// Values below this part of the mean count as this much: a dark point does not decide a relative error.
const FLOOR: f64 = 0.01;
/// The same for pixels of surfaces.
const DARK: f64 = 0.05;
/// Points whose given standard error is above this part of their value are left out.
const TRUSTED: f64 = 0.02;

/// Irradiance at the points of a reference table, from a solution.
pub fn probe(prefix: &Path, points: &Table) -> Option<Vec<[f64; 3]>> {
    let (asked, output) = (prefix.with_extension("points.csv"), prefix.with_extension("probed.csv"));
    let mut text = String::from("x,y,z,nx,ny,nz\n");
    for row in 0..points.rows.len() {
        let cell = |name: &str, missing: &str| match points.header.iter().position(|h| h == name) {
            Some(column) => points.rows[row][column].clone(),
            None => missing.to_owned(),
        };
        let cells =
            [("x", ""), ("y", ""), ("z", ""), ("nx", "0"), ("ny", "1"), ("nz", "0")].map(|(n, m)| cell(n, m));
        text += &format!("{}\n", cells.join(","));
    }
    std::fs::write(&asked, text).unwrap_or_else(|e| panic!("{}: {e}", asked.display()));
    let mut probe = tool("shade-tool");
    probe.arg("probe").arg(prefix.with_extension("sol")).arg("--mesh").arg(prefix.with_extension("mesh"));
    let done = run(probe.arg("--points").arg(&asked).arg("-o").arg(&output));
    if !matches!(done.code, Some(0 | 3)) {
        eprintln!("proof: probe: {}", done.stderr);
        return None;
    }
    let table = Table::read(&output);
    let number = |row: usize| ["H_r", "H_g", "H_b"].map(|column| table.number(row, column));
    Some((0..table.rows.len()).map(number).collect())
}

/// The given irradiances of a table, NaN where their own standard error is large.
pub fn given(points: &Table) -> Vec<[f64; 3]> {
    let trusted = |row: usize, channel: &str| {
        let value = points.number(row, &format!("E_{channel}"));
        let known = points.header.iter().any(|h| *h == format!("seE_{channel}"));
        let error = if known { points.number(row, &format!("seE_{channel}")) } else { 0.0 };
        if error > TRUSTED * value { f64::NAN } else { value }
    };
    (0..points.rows.len()).map(|row| ["r", "g", "b"].map(|channel| trusted(row, channel))).collect()
}

/// RMS relative error that the standard errors of the given irradiances alone would make; NaN where the table has none, as exact
/// answers do.
pub fn given_noise(points: &Table) -> f64 {
    let known = |channel: &str| points.header.iter().any(|h| *h == format!("seE_{channel}"));
    if !["r", "g", "b"].into_iter().all(known) {
        return f64::NAN;
    }
    let want = given(points);
    let mut got = want.clone();
    for (row, values) in got.iter_mut().enumerate() {
        for (value, channel) in values.iter_mut().zip(["r", "g", "b"]) {
            *value += points.number(row, &format!("seE_{channel}"));
        }
    }
    rms(&got, &want)
}

/// RMS relative error over points and channels; a NaN that is wanted is left out, one that was got makes the result NaN.
pub fn rms(got: &[[f64; 3]], want: &[[f64; 3]]) -> f64 {
    let (mut sum, mut count) = (0.0, 0u32);
    for channel in 0..3 {
        let known: Vec<f64> = want.iter().map(|w| w[channel]).filter(|w| w.is_finite()).collect();
        let floor = FLOOR * known.iter().sum::<f64>() / known.len().max(1) as f64;
        for (got, want) in got.iter().zip(want).filter(|(_, want)| want[channel].is_finite()) {
            sum += ((got[channel] - want[channel]) / want[channel].max(floor)).powi(2);
            count += 1;
        }
    }
    if count == 0 || got.len() != want.len() { f64::NAN } else { (sum / f64::from(count)).sqrt() }
}

/// RMS difference of two pictures over their mean, the quadratic mean of the channels.
pub fn picture(first: &Path, second: &Path) -> f64 {
    let mut compare = tool("shade-tool");
    let done = run(compare.arg("compare").arg(first).arg(second).arg("--json"));
    let compared = json(&done);
    let channels = compared["channels"].as_array().cloned().unwrap_or_default();
    let squares: Option<Vec<f64>> =
        channels.iter().map(|channel| Some(channel["relative_rms"].as_f64()?.powi(2))).collect();
    squares.filter(|s| !s.is_empty()).map_or(f64::NAN, |s| (s.iter().sum::<f64>() / s.len() as f64).sqrt())
}

/// RMS relative error over pixels and channels of what is no lamp: pixels above `lamp` in `reference`, whose borders cross pixels, and
/// their eight neighbours are left out. NaN where a picture cannot be read or the sizes differ.
pub fn surfaces(picture: &Path, reference: &Path, lamp: f64) -> f64 {
    let read = |path: &Path| StoredPicture::read(path).map_err(|e| eprintln!("proof: {e}"));
    match (read(picture), read(reference)) {
        (Ok(got), Ok(want)) => surfaces_of(&got.picture, &want.picture, lamp),
        _ => f64::NAN,
    }
}

fn surfaces_of(got: &Picture, want: &Picture, lamp: f64) -> f64 {
    let (width, height) = (want.width, want.height);
    if (got.width, got.height) != (width, height) {
        return f64::NAN;
    }
    let shines = |x: usize, y: usize| want.pixels[y * width + x].iter().any(|&value| value > lamp);
    let around = |at: usize, size: usize| at.saturating_sub(1)..size.min(at + 2);
    let near_lamp =
        |i: usize| around(i / width, height).any(|y| around(i % width, width).any(|x| shines(x, y)));
    let kept: Vec<usize> = (0..want.pixels.len()).filter(|&i| !near_lamp(i)).collect();
    let mut squares = 0.0;
    for channel in 0..3 {
        let mean = kept.iter().map(|&i| want.pixels[i][channel]).sum::<f64>() / kept.len().max(1) as f64;
        for &i in &kept {
            let value = want.pixels[i][channel];
            squares += ((got.pixels[i][channel] - value) / value.max(DARK * mean)).powi(2);
        }
    }
    (squares / (3.0 * kept.len() as f64)).sqrt()
}

/// Mean and worst over rows of the sum over j of |difference of F_ij|.
pub fn rows(first: &Path, second: &Path) -> [f64; 2] {
    let mut compare = tool("formfactor-tool");
    let compared = json(&run(compare.arg("compare").arg(first).arg(second).arg("--json")));
    let differences = &compared["row_difference"];
    ["mean", "worst"].map(|key| differences[key].as_f64().unwrap_or(f64::NAN))
}

fn json(done: &Run) -> Value {
    serde_json::from_str(&done.stdout).unwrap_or_else(|_| {
        eprintln!("proof: a comparison failed: {}", done.stderr);
        Value::Null
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rms_is_relative_and_leaves_the_unknown_out() {
        let want = [[1.0, 2.0, f64::NAN], [1.0, 2.0, f64::NAN]];
        let got = [[1.1, 2.2, 5.0], [0.9, 1.8, 5.0]];
        crate::assert_close("rms", rms(&got, &want), 0.1, crate::Tolerance::Rel(1e-12));
        assert!(rms(&[[f64::NAN; 3]; 2], &want).is_nan());
        assert!(rms(&[], &[]).is_nan());
    }

    #[test]
    fn pixels_at_lamps_do_not_count_and_dark_ones_count_as_a_twentieth_of_the_mean() {
        let picture = |pixels: [f64; 5]| Picture {
            width: 5,
            height: 1,
            pixels: pixels.map(|x| [x; 3]).to_vec(),
            ..Picture::default()
        };
        let want = picture([9.0, 1.0, 1.0, 2.0, 0.0]);
        // The mean of the last three is 1, so the black one is off by 0.01 / 0.05; the one beside the lamp is left out.
        let error = surfaces_of(&picture([7.0, 3.0, 1.1, 1.8, 0.01]), &want, 4.0);
        crate::assert_close("surfaces", error, (0.06f64 / 3.0).sqrt(), crate::Tolerance::Rel(1e-12));
        assert!(surfaces_of(&Picture::default(), &want, 4.0).is_nan());
    }

    #[test]
    fn noise_of_given_points_is_their_standard_error() {
        let table = |header: &str, cells: [&str; 2]| Table {
            header: header.split(',').map(str::to_owned).collect(),
            rows: cells.map(|row| row.split(',').map(str::to_owned).collect()).to_vec(),
        };
        let rows = ["1,2,4,0.01,0.02,0.04", "1,2,4,0.01,0.02,0.4"];
        // The last standard error is a tenth of its value: that value is not trusted.
        let noise = given_noise(&table("E_r,E_g,E_b,seE_r,seE_g,seE_b", rows));
        crate::assert_close("noise", noise, 0.01, crate::Tolerance::Rel(1e-9));
        assert!(given_noise(&table("E_r,E_g,E_b", ["1,2,4", "1,2,4"])).is_nan());
    }
}
