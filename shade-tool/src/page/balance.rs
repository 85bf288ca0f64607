//! Where the light goes: per group the power that is emitted, arrives, is absorbed and escapes, summed over the channels;
//! and the same for the whole scene by channel, where emitted = absorbed + escaped.

use super::input::Input;
use super::markup::{Table, number};
use interchange::grouping::{By, Grouping};

/// Powers of a group, by channel.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Powers {
    /// Area, hidden area included.
    pub area: f64,
    /// Sum of A E.
    pub emitted: [f64; 3],
    /// Sum of A H.
    pub received: [f64; 3],
    /// Sum of A (H - (B - E)): what is not reflected.
    pub absorbed: [f64; 3],
    /// Sum of A B (1 - row sum of F); None where the solution does not state row sums.
    pub escaped: Option<[f64; 3]>,
}

/// The powers of every group, in the mesh's order.
pub fn powers(input: &Input) -> Vec<Powers> {
    let grouping = Grouping::new(&input.mesh, By::Group);
    let details = &input.solution.details;
    let mut all: Vec<Powers> = grouping
        .hidden_areas
        .iter()
        .map(|&area| Powers {
            area,
            escaped: details.row_sums.as_ref().map(|_| [0.0; 3]),
            ..Powers::default()
        })
        .collect();
    for element in input.mesh.element_ids() {
        let i = element.index();
        let own = &mut all[grouping.key_of_element[i] as usize];
        let area = input.areas[i];
        let exitance = match &details.exitance {
            Some(exitance) => exitance[i],
            None => input.materials[input.mesh.element_material(element).index()].exitance(),
        };
        own.area += area;
        for c in 0..3 {
            let (b, h) = (input.solution.radiosity[i][c], input.solution.irradiance[i][c]);
            own.emitted[c] += area * exitance[c];
            own.received[c] += area * h;
            own.absorbed[c] += area * (h - (b - exitance[c]));
            if let (Some(escaped), Some(row_sums)) = (&mut own.escaped, &details.row_sums) {
                escaped[c] += area * b * (1.0 - row_sums[i]);
            }
        }
    }
    all
}

/// The two tables.
pub fn tables(input: &Input) -> String {
    let powers = powers(input);
    let unit = input.power_unit();
    let with_unit = |what: &str| format!("{what}, {unit}");
    let area = format!("area, {}²", input.unit);
    let [emitted, received, absorbed, escaped] =
        ["emitted", "received", "absorbed", "escaped"].map(with_unit);
    let mut by_group =
        Table::new(&["group", &area, &emitted, &received, &absorbed, &escaped, "mean H, W m⁻² (R G B)"]);
    let sum = |x: &[f64; 3]| x.iter().sum::<f64>();
    let cells = |p: &Powers| {
        let mean = p.received.map(|x| if p.area > 0.0 { number(x / p.area) } else { number(0.0) });
        [
            number(p.area),
            number(sum(&p.emitted)),
            number(sum(&p.received)),
            number(sum(&p.absorbed)),
            p.escaped.as_ref().map_or("–".into(), |x| number(sum(x))),
            mean.join(" &ensp; "),
        ]
    };
    let mut whole =
        Powers { escaped: input.solution.details.row_sums.as_ref().map(|_| [0.0; 3]), ..Powers::default() };
    for (name, group) in input.mesh.groups.iter().zip(&powers) {
        by_group.row(name, cells(group));
        whole.area += group.area;
        for c in 0..3 {
            whole.emitted[c] += group.emitted[c];
            whole.received[c] += group.received[c];
            whole.absorbed[c] += group.absorbed[c];
            if let (Some(sum), Some(escaped)) = (&mut whole.escaped, &group.escaped) {
                sum[c] += escaped[c];
            }
        }
    }
    by_group.row("whole scene", cells(&whole));

    let mut by_channel =
        Table::new(&["channel", &emitted, &absorbed, &escaped, "not accounted for, of the emitted"]);
    for (c, name) in ["red", "green", "blue"].into_iter().enumerate() {
        let escaped = whole.escaped.map(|x| x[c]);
        let defect = escaped.map(|x| whole.emitted[c] - whole.absorbed[c] - x);
        let relative = defect.filter(|_| whole.emitted[c] > 0.0).map(|x| number(x / whole.emitted[c]));
        by_channel.row(
            name,
            [
                number(whole.emitted[c]),
                number(whole.absorbed[c]),
                escaped.map_or("–".into(), number),
                relative.unwrap_or("–".into()),
            ],
        );
    }
    by_group.html() + &by_channel.html()
}
