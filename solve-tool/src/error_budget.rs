//! What errors of the matrix do to the radiosity, and which matrix the asked error would need.
//!
//! If row i of F is off by e_i = sum over j of |dF_ij|, and S~ is symmetric like S, then
//! |dK B| <= sum over i, j of rho_i |dS_ij| B_j <= rho_max sum over j of A_j e_j B_j, so that
//!
//!   |dB| / |B| <= |(I - K)^-1| rho_max e,   e = (sum A e B) / (sum A B)
//!
//! in the power norm: row error times rho / (1 - rho) where rho is uniform, as the furnace shows exactly.

use interchange::matrix::{MatrixRecord, Precision};

/// Tolerance of a matrix below which its entries are stored as f64.
const LEAST_F32: f64 = 1e-6;

/// What the matrix's errors mean for one channel.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct MatrixError {
    /// Estimated relative error of the radiosity in the power norm; infinite where there is no bound.
    pub relative: f64,
    /// Mean row error, weighted with the power that leaves each row.
    pub row_error: f64,
    /// |(I - K)^-1| rho_max: what a row error is multiplied with.
    pub amplification: f64,
}

/// What a part of the scene, solved by itself, has to do with the matrix's errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartPower {
    /// |(I - K)^-1| there.
    pub factor: f64,
    /// Its largest reflectance.
    pub brightest: f64,
    /// Power that its row errors misplace, sum of A e B, W.
    pub wrong: f64,
}

/// Effect of the matrix's row errors on a channel of which the elements send `power`, sum of A B, in W.
pub fn matrix_error(parts: &[PartPower], power: f64) -> MatrixError {
    let wrong: f64 = parts.iter().map(|part| part.wrong).sum();
    // A black part amplifies nothing, whatever else is known.
    let factor = |part: &PartPower| if part.brightest > 0.0 { part.factor * part.brightest } else { 0.0 };
    let changed: f64 = parts
        .iter()
        .filter(|part| part.wrong > 0.0 && part.brightest > 0.0)
        .map(|part| factor(part) * part.wrong)
        .sum();
    let largest = parts.iter().map(factor).fold(0.0, f64::max);
    if power == 0.0 || wrong == 0.0 {
        return MatrixError { relative: 0.0, row_error: 0.0, amplification: largest };
    }
    MatrixError { relative: changed / power, row_error: wrong / power, amplification: changed / wrong }
}

/// What to tell the user where the matrix is not good enough for the asked error: `asked` is solve-tool's
/// tolerance, `matrix` the matrix's own account of itself. `None` where the matrix is good enough.
pub fn shortfall(error: &MatrixError, asked: f64, matrix: &MatrixRecord, channel: &str) -> Option<String> {
    if error.relative <= asked {
        return None;
    }
    let needed = rounded_down(asked / error.amplification);
    let stored = match matrix.precision {
        // Half an ulp of each entry is a row error of its own.
        Precision::F32 if needed < LEAST_F32 => {
            ", which stores f64: entries stored as f32 are off by 6e-8 each"
        }
        _ => "",
    };
    let remedy = match needed > 0.0 {
        true => format!(
            "that needs a matrix with row errors of at most {needed:e}: formfactor-tool compute --tolerance {needed:e}\
             {stored}, or a larger --tolerance here"
        ),
        false => "no matrix tolerance helps, because no bound below infinity could be proved".into(),
    };
    let matrix_tolerance = matrix.tolerance;
    Some(format!(
        "errors of the matrix may change the radiosity by {:.1e} in the {channel} channel (row errors {:.1e} times {:.3} \
         by interreflection; the matrix was asked for {matrix_tolerance:e}), more than the asked {asked:e}; {remedy}",
        error.relative, error.row_error, error.amplification
    ))
}

/// The largest d * 10^k with one digit d that is not above `x`; 0 where there is none.
fn rounded_down(x: f64) -> f64 {
    if !(x > 0.0 && x.is_finite()) {
        return 0.0;
    }
    let exponent = x.log10().floor() as i32;
    // The text of a one-digit number reads back as the nearest double, which powi would miss.
    let digit = (x / 10f64.powi(exponent)).floor().clamp(1.0, 9.0);
    format!("{digit}e{exponent}").parse().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tolerances_are_rounded_down_to_one_digit() {
        assert_eq!(rounded_down(2.7e-7), 2e-7);
        assert_eq!(rounded_down(1e-8), 1e-8);
        assert_eq!(rounded_down(0.0), 0.0);
        assert_eq!(rounded_down(f64::INFINITY), 0.0);
    }

    #[test]
    fn a_shortfall_names_the_tolerance_it_needs() {
        let mut matrix = MatrixRecord {
            elements: 2,
            mesh: interchange::digest::Digest::of(b"mesh"),
            precision: Precision::F32,
            symmetric: true,
            extended: false,
            tolerance: 1e-4,
            part: 0,
            parts: 1,
        };
        let error = MatrixError { relative: 9.9e-3, row_error: 1e-4, amplification: 99.0 };
        assert_eq!(shortfall(&error, 1e-2, &matrix, "red"), None);
        let text = shortfall(&error, 1e-6, &matrix, "red").unwrap_or_default();
        assert!(text.contains("formfactor-tool compute --tolerance 1e-8, which stores f64"), "{text}");
        let text = shortfall(&error, 1e-3, &matrix, "red").unwrap_or_default();
        assert!(text.contains("--tolerance 1e-5, or a larger"), "{text}");
        matrix.precision = Precision::F64;
        let text = shortfall(&error, 1e-6, &matrix, "red").unwrap_or_default();
        assert!(text.contains("--tolerance 1e-8, or a larger"), "{text}");
    }
}
