//! Polygons with values: what every foreign format of geometry is written from.

use crate::ids::NodeId;
use crate::materials::{Material, MaterialTable};
use crate::mesh::Mesh;
use crate::ragged::Ragged;

/// Values of a field.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Numbers with a fraction, `components` for each item, one item after another.
    F64(Vec<f64>),
    /// Whole numbers, one for each item.
    U32(Vec<u32>),
}

/// A named value of every point or of every polygon.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Name, one word.
    pub name: String,
    /// Numbers for each item: 1, or 3 for a colour.
    pub components: usize,
    /// The numbers.
    pub values: Values,
}

impl Field {
    /// One number for each item.
    pub fn scalars(name: &str, values: Vec<f64>) -> Self {
        Self { name: name.into(), components: 1, values: Values::F64(values) }
    }

    /// One whole number for each item.
    pub fn numbers(name: &str, values: Vec<u32>) -> Self {
        Self { name: name.into(), components: 1, values: Values::U32(values) }
    }

    /// Red, green, blue for each item.
    pub fn colours(name: &str, values: &[[f64; 3]]) -> Self {
        Self { name: name.into(), components: 3, values: Values::F64(values.as_flattened().to_vec()) }
    }
}

/// Convex polygons that share points, with their names and values.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surface {
    /// Places.
    pub points: Vec<[f64; 3]>,
    /// Points of each polygon, counter-clockwise seen from its front.
    pub polygons: Ragged<u32>,
    /// Names of the groups.
    pub groups: Vec<String>,
    /// Group of each polygon.
    pub polygon_groups: Vec<u32>,
    /// Materials with their names; black where nothing is known of them.
    pub materials: Vec<(String, Material)>,
    /// Material of each polygon.
    pub polygon_materials: Vec<u32>,
    /// Values at the points.
    pub point_fields: Vec<Field>,
    /// Values of the polygons.
    pub polygon_fields: Vec<Field>,
    /// How bright each point shows: linear, within [0, 1]. None where the surface is to be lit by the program that shows it.
    pub colours: Option<Vec<[f64; 3]>>,
    /// How bright each polygon is: radiance, W m^-2 sr^-1. Together with `colours` or not at all.
    pub radiances: Option<Vec<[f64; 3]>>,
    /// What to say of it, one line each.
    pub comments: Vec<String>,
}

impl Surface {
    /// The elements of a mesh. Points are the nodes at corners: elements that meet where light jumps share a place but no
    /// point. The fields are numbers from 1 of element and scene's face, group and material (from 1, in the order of the
    /// mesh), and the side.
    pub fn of_mesh(mesh: &Mesh, materials: Option<&MaterialTable>) -> Self {
        // Nodes in the middle of edges are left out: no element has them as corners.
        let mut point_of_node = vec![u32::MAX; mesh.node_vertices.len()];
        let mut points = Vec::new();
        let polygons = mesh.elements.rows().zip(mesh.element_nodes.rows()).map(|(corners, nodes)| {
            nodes[..corners.len()]
                .iter()
                .map(|&NodeId(node)| {
                    let point = &mut point_of_node[node as usize];
                    if *point == u32::MAX {
                        *point = points.len() as u32;
                        points.push(mesh.vertices[mesh.node_vertices[node as usize].index()]);
                    }
                    *point
                })
                .collect::<Vec<u32>>()
        });
        let polygons: Ragged<u32> = polygons.collect();
        let groups: Vec<u32> = mesh.element_ids().map(|e| mesh.element_group(e).0).collect();
        let material: Vec<u32> = mesh.element_ids().map(|e| mesh.element_material(e).0).collect();
        let from_one = |numbers: &[u32]| numbers.iter().map(|n| n + 1).collect::<Vec<u32>>();
        let known = |name: &String| materials.and_then(|table| table.get(name)).copied().unwrap_or_default();
        Self {
            points,
            polygons,
            polygon_fields: vec![
                Field::numbers("element", (1..=mesh.element_count() as u32).collect()),
                Field::numbers("face", mesh.element_ids().map(|e| mesh.element_input(e) + 1).collect()),
                Field::numbers("group", from_one(&groups)),
                Field::numbers("material", from_one(&material)),
                Field::numbers("side", mesh.element_sides.clone()),
            ],
            groups: mesh.groups.clone(),
            polygon_groups: groups,
            materials: mesh.materials.iter().map(|name| (name.clone(), known(name))).collect(),
            polygon_materials: material,
            ..Self::default()
        }
    }

    /// Values of the polygons carried to the points: the mean over the polygons that share a point, by their weights.
    /// Points are shared only where light does not jump, so that no mean crosses a shadow's edge.
    pub fn at_points(&self, values: &[[f64; 3]], weights: &[f64]) -> Vec<[f64; 3]> {
        let mut sums = vec![[0.0; 4]; self.points.len()];
        for (polygon, (value, &weight)) in self.polygons.rows().zip(values.iter().zip(weights)) {
            for &point in polygon {
                let sum = &mut sums[point as usize];
                (0..3).for_each(|c| sum[c] += weight * value[c]);
                sum[3] += weight;
            }
        }
        let mean = |[r, g, b, weight]: [f64; 4]| match weight > 0.0 {
            true => [r / weight, g / weight, b / weight],
            false => [0.0; 3],
        };
        sums.into_iter().map(mean).collect()
    }

    /// Colours for radiances at the points: `white` and more shows as 1.
    pub fn shown(radiances: &[[f64; 3]], white: f64) -> Vec<[f64; 3]> {
        radiances.iter().map(|radiance| radiance.map(|x| (x / white).clamp(0.0, 1.0))).collect()
    }

    /// The radiance that a share of the area stays below, in its brightest channel: what can show as white. 1 where all
    /// is dark.
    pub fn white(radiances: &[[f64; 3]], areas: &[f64], share: f64) -> f64 {
        let mut brightest: Vec<(f64, f64)> =
            radiances.iter().zip(areas).map(|(l, &area)| (l[0].max(l[1]).max(l[2]), area)).collect();
        brightest.sort_by(|a, b| a.0.total_cmp(&b.0));
        let wanted = share * areas.iter().sum::<f64>();
        let mut below = 0.0;
        let found = brightest.iter().find(|(_, area)| {
            below += area;
            below >= wanted
        });
        let lit = |&&(l, _): &&(f64, f64)| l > 0.0;
        found.filter(lit).or(brightest.last().filter(lit)).map_or(1.0, |(l, _)| *l)
    }

    /// Triangles of each polygon as a fan from its first corner.
    pub(super) fn triangles(&self, polygon: usize) -> impl Iterator<Item = [u32; 3]> + '_ {
        let corners = self.polygons.row(polygon);
        (1..corners.len().saturating_sub(1)).map(move |k| [corners[0], corners[k], corners[k + 1]])
    }
}

#[cfg(test)]
pub(super) mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// A unit square and a triangle that shares an edge with it, standing upright; in two groups.
    pub(in crate::foreign) fn two_polygons() -> Surface {
        Surface {
            points: vec![
                [0.0, 0.0, 0.0],
                [1.0, 0.0, 0.0],
                [1.0, 1.0, 0.0],
                [0.0, 1.0, 0.0],
                [0.5, 0.1, 1.0 / 3.0],
            ],
            polygons: vec![vec![0, 1, 2, 3], vec![1, 0, 4]].into_iter().collect(),
            groups: vec!["the floor".into(), "flap".into()],
            polygon_groups: vec![0, 1],
            materials: vec![
                ("grey".into(), Material { diffuse: [0.5, 0.25, 0.125], ..Material::default() }),
                ("lamp".into(), Material { radiance: [3.0, 2.0, 1.0], ..Material::default() }),
            ],
            polygon_materials: vec![0, 1],
            polygon_fields: vec![
                Field::numbers("element", vec![1, 2]),
                Field::colours("B", &[[1.0, 2.0, 3.0], [0.1, 0.2, 0.3]]),
            ],
            point_fields: vec![Field::scalars("height", vec![0.0, 0.0, 0.0, 0.0, 1.0 / 3.0])],
            comments: vec!["made by a test".into()],
            ..Surface::default()
        }
    }

    #[test]
    fn means_at_points_are_weighted_and_white_is_a_share_of_the_area() {
        let surface = two_polygons();
        let means = surface.at_points(&[[1.0; 3], [4.0; 3]], &[2.0, 1.0]);
        assert_eq!(means[0], [2.0; 3]);
        assert_eq!((means[2], means[4]), ([1.0; 3], [4.0; 3]));
        let radiances = [[1.0, 0.0, 0.0], [0.0, 5.0, 0.0]];
        assert_eq!(Surface::white(&radiances, &[99.0, 1.0], 0.98), 1.0);
        assert_eq!(Surface::white(&radiances, &[99.0, 1.0], 1.0), 5.0);
        assert_eq!(Surface::white(&[[0.0; 3]], &[1.0], 0.5), 1.0);
        assert_eq!(Surface::shown(&radiances, 2.0), [[0.5, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    }

    #[test]
    fn a_polygon_is_a_fan() {
        let surface = two_polygons();
        assert_eq!(surface.triangles(0).collect::<Vec<_>>(), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(surface.triangles(1).collect::<Vec<_>>(), [[1, 0, 4]]);
    }
}
