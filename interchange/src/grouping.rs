//! How exports gather elements: by element, by the scene's face or by the user's group.
//!
//! Numbers of faces and elements count from 1 in exported tables, as in OBJ and MatrixMarket: face 1 is the first `f`
//! line. Both sides of a two-sided face have one face number and one group, so their areas and powers are summed.

use crate::mesh::Mesh;

/// What the rows of an export stand for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum By {
    /// Elements of the mesh, numbered from 1
    Element,
    /// Faces of the scene in file order, numbered from 1
    Face,
    /// Groups of the scene, by name
    Group,
}

/// Elements gathered under keys, each key one row of the export.
#[derive(Debug, Clone, PartialEq)]
pub struct Grouping {
    /// Title of the key column.
    pub title: &'static str,
    /// Text of each key; keys without elements (dropped faces) included.
    pub labels: Vec<String>,
    /// Key of each element.
    pub key_of_element: Vec<u32>,
    /// Area under each key that is hidden and has no elements: irradiance and radiosity are 0 there.
    pub hidden_areas: Vec<f64>,
}

impl Grouping {
    /// The elements of `mesh` gathered as `by` says.
    pub fn new(mesh: &Mesh, by: By) -> Self {
        let numbers = |count: usize| (1..=count).map(|n| n.to_string()).collect();
        let elements = mesh.element_ids();
        let hidden = |keys: usize, key: &dyn Fn(usize) -> u32| {
            let mut areas = vec![0.0; keys];
            for (face, area) in mesh.hidden_areas.iter().enumerate() {
                areas[key(face) as usize] += area;
            }
            areas
        };
        match by {
            By::Element => Self {
                title: "element",
                labels: numbers(mesh.element_count()),
                key_of_element: elements.map(|e| e.0).collect(),
                hidden_areas: vec![0.0; mesh.element_count()],
            },
            By::Face => Self {
                title: "face",
                labels: numbers(mesh.input_face_count as usize),
                key_of_element: elements.map(|e| mesh.element_input(e)).collect(),
                hidden_areas: hidden(mesh.input_face_count as usize, &|face| mesh.face_inputs[face]),
            },
            By::Group => Self {
                title: "group",
                labels: mesh.groups.clone(),
                key_of_element: elements.map(|e| mesh.element_group(e).0).collect(),
                hidden_areas: hidden(mesh.groups.len(), &|face| mesh.face_groups[face].0),
            },
        }
    }

    /// Number of keys.
    pub fn len(&self) -> usize {
        self.labels.len()
    }

    /// Whether there are no keys.
    pub fn is_empty(&self) -> bool {
        self.labels.is_empty()
    }

    /// Sum over the elements of each key.
    pub fn sums(&self, value_of_element: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut sums = vec![0.0; self.len()];
        for (element, &key) in self.key_of_element.iter().enumerate() {
            sums[key as usize] += value_of_element(element);
        }
        sums
    }
}
