//! The solver's way to its solution as a drawing (SVG): the bound of each channel after each product with the matrix,
//! on a logarithmic scale, and the bound that was asked for.

use super::markup::escape;
use std::fmt::Write;

/// Size of the drawing, and the margins its labels need: left, right, top, bottom.
const SIZE: [f64; 2] = [640.0, 360.0];
const MARGINS: [f64; 4] = [70.0, 20.0, 20.0, 52.0];
/// Names and colours of the channels, told apart by dashes, too.
const CHANNELS: [(&str, &str, &str); 3] =
    [("red", "#b3392f", ""), ("green", "#3d7a4a", "7 3"), ("blue", "#35609c", "2 3")];
/// At most about so many labels along the steps.
const MOST_LABELS: usize = 12;
/// At most this many decades: a solver that ends at 0 would leave nothing of the rest.
const MOST_DECADES: i32 = 16;

/// The drawing; None where no bound is above 0.
pub fn convergence(history: &[[f64; 3]], asked: f64) -> Option<String> {
    let known = |x: &f64| x.is_finite() && *x > 0.0;
    let all: Vec<f64> = history.iter().flatten().copied().filter(known).collect();
    let highest = all.iter().copied().reduce(f64::max)?;
    let lowest = all.iter().copied().chain(Some(asked).filter(known)).reduce(f64::min)?;
    let top = highest.log10().ceil() as i32;
    let bottom = (lowest.log10().floor() as i32).min(top - 1).max(top - MOST_DECADES);

    let [left, right, above, below] = MARGINS;
    let (width, height) = (SIZE[0] - left - right, SIZE[1] - above - below);
    let last = history.len().saturating_sub(1).max(1);
    let x = |step: usize| left + width * step as f64 / last as f64;
    let y = |value: f64| above + height * (f64::from(top) - value.log10()) / f64::from(top - bottom);

    let mut svg = format!(
        "<svg class=\"plot\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"Convergence of the solver\">\n",
        SIZE[0], SIZE[1]
    );
    // Lines and labels of the decades, then of the steps.
    let stride = ((top - bottom) / 8).max(1) as usize;
    for power in (bottom..=top).step_by(stride) {
        let place = y(10f64.powi(power));
        let _ = writeln!(
            svg,
            "<line class=\"grid\" x1=\"{left}\" x2=\"{}\" y1=\"{place:.2}\" y2=\"{place:.2}\"/>\
             <text x=\"{}\" y=\"{:.2}\" text-anchor=\"end\">10<tspan dy=\"-5\" font-size=\"9\">{}</tspan></text>",
            left + width,
            left - 8.0,
            place + 4.0,
            power.to_string().replace('-', "−"),
        );
    }
    for step in (0..history.len()).step_by(history.len().div_ceil(MOST_LABELS).max(1)) {
        let (place, base) = (x(step), above + height);
        let _ = writeln!(
            svg,
            "<line class=\"axis\" x1=\"{place:.2}\" x2=\"{place:.2}\" y1=\"{base}\" y2=\"{}\"/>\
             <text x=\"{place:.2}\" y=\"{}\" text-anchor=\"middle\">{step}</text>",
            base + 5.0,
            base + 19.0,
        );
    }
    let _ = writeln!(
        svg,
        "<path class=\"axis\" fill=\"none\" d=\"M{left} {above}V{}H{}\"/>\
         <text x=\"{}\" y=\"{}\" text-anchor=\"middle\">step</text>\
         <text transform=\"translate(16 {}) rotate(-90)\" text-anchor=\"middle\">error bound / emitted power</text>",
        above + height,
        left + width,
        left + width / 2.0,
        SIZE[1] - 10.0,
        above + height / 2.0,
    );
    if known(&asked) && asked.log10() >= f64::from(bottom) {
        let place = y(asked);
        let _ = writeln!(
            svg,
            "<line class=\"asked\" x1=\"{left}\" x2=\"{}\" y1=\"{place:.2}\" y2=\"{place:.2}\"/>\
             <text x=\"{}\" y=\"{:.2}\">asked: {}</text>",
            left + width,
            left + 6.0,
            place - 5.0,
            escape(&format!("{asked:e}")),
        );
    }
    // One line for each channel, broken where its bound is 0 or unknown.
    for (channel, (name, colour, dashes)) in CHANNELS.into_iter().enumerate() {
        let lowest = 10f64.powi(bottom);
        let mut path = String::new();
        let mut pen_down = false;
        let mut dots = String::new();
        for (step, bounds) in history.iter().enumerate() {
            let value = bounds[channel];
            if known(&value) {
                let (px, py) = (x(step), y(value.max(lowest)));
                let _ = write!(path, "{}{px:.2} {py:.2}", if pen_down { 'L' } else { 'M' });
                let _ = write!(dots, "<circle cx=\"{px:.2}\" cy=\"{py:.2}\" r=\"2.6\" fill=\"{colour}\"/>");
            }
            pen_down = known(&value);
        }
        let key = left + width - 130.0 + 50.0 * channel as f64;
        let _ = writeln!(
            svg,
            "<path class=\"bound\" d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.6\" \
             stroke-dasharray=\"{dashes}\"/>{}<text x=\"{key}\" y=\"{}\" fill=\"{colour}\">{name}</text>",
            if history.len() <= 60 { dots } else { String::new() },
            above + 8.0,
        );
    }
    svg.push_str("</svg>");
    Some(svg)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn every_bound_is_a_place_and_decades_are_labelled() {
        let history = [[1.0, 0.1, 0.0], [0.1, 0.01, 0.0], [1e-3, 1e-3, 0.0]];
        let svg = convergence(&history, 1e-3).unwrap();
        assert_eq!(svg.matches("<circle").count(), 6);
        assert!(svg.contains("asked: 1e-3") && svg.contains(">−3</tspan>") && svg.contains("emitted power"));
        // The first bound lies at the top, the last one at the bottom.
        assert!(svg.contains("M70.00 20.00") && svg.contains("L620.00 308.00"), "{svg}");
    }

    #[test]
    fn nothing_to_draw_is_no_drawing() {
        assert_eq!(convergence(&[], 1e-3), None);
        assert_eq!(convergence(&[[0.0; 3]], 1e-3), None);
        assert!(convergence(&[[1e-2; 3]], 1e-2).is_some());
        assert!(convergence(&[[1.0; 3], [1e-300; 3]], 0.0).unwrap().contains("M70.00"));
    }
}
