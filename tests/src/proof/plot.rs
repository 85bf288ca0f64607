//! Time against error, one curve per method and mesh, both axes logarithmic.

use super::record::Row;
use plotters::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;

/// Draws the rows of one scene; nothing where fewer than two were measured.
pub fn draw(path: &Path, scene: &str, rows: &[&Row]) -> Result<(), Box<dyn std::error::Error>> {
    let mut curves: BTreeMap<String, Vec<(f64, f64)>> = BTreeMap::new();
    for row in rows.iter().filter(|row| row.state == "done" && row.main_error() > 0.0) {
        let point = (row.main_error(), row.cpu_s().max(1e-3));
        curves.entry(format!("{} / {}", row.method, row.mesh)).or_default().push(point);
    }
    let points: Vec<(f64, f64)> = curves.values().flatten().copied().collect();
    if points.len() < 2 {
        return Ok(());
    }
    let range = |pick: fn(&(f64, f64)) -> f64| {
        let low = points.iter().map(pick).fold(f64::INFINITY, f64::min);
        let high = points.iter().map(pick).fold(0.0, f64::max);
        (low / 1.5..high * 1.5).log_scale()
    };
    let area = SVGBackend::new(path, (800, 560)).into_drawing_area();
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&area)
        .caption(format!("{scene}: time against error"), ("sans-serif", 20))
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d(range(|p| p.0), range(|p| p.1))?;
    let number = |x: &f64| format!("{x:.1e}");
    chart
        .configure_mesh()
        .x_desc("measured error, relative")
        .y_desc("CPU seconds, all stages")
        .x_label_formatter(&number)
        .y_label_formatter(&number)
        .light_line_style(WHITE)
        .draw()?;
    for (index, (name, mut points)) in curves.into_iter().enumerate() {
        points.sort_by(|a, b| a.1.total_cmp(&b.1));
        let colour = Palette99::pick(index).to_rgba();
        let markers: Vec<_> = points.iter().map(|&p| Circle::new(p, 4, colour.filled())).collect();
        chart
            .draw_series(LineSeries::new(points, colour.stroke_width(2)))?
            .label(name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
        chart.draw_series(markers)?;
    }
    chart.configure_series_labels().background_style(WHITE.mix(0.8)).border_style(BLACK).draw()?;
    area.present()?;
    Ok(())
}
