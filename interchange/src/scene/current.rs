//! The name that following faces take (`g`, `usemtl`), entered into a table when the first face takes it.

use super::NONE;
use std::collections::HashMap;

/// A current name and the table of those taken, in order of first face.
#[derive(Debug)]
pub(super) struct Current {
    name: String,
    entry: Option<u32>,
    names: Vec<String>,
    index: HashMap<String, u32>,
}

impl Default for Current {
    fn default() -> Self {
        Self { name: NONE.to_owned(), entry: None, names: Vec::new(), index: HashMap::new() }
    }
}

impl Current {
    /// Following faces take `name`.
    pub fn set(&mut self, name: &str) {
        name.clone_into(&mut self.name);
        self.entry = None;
    }

    /// A face takes the current name: its place in the table. The name is looked up once for all faces under it.
    pub fn entry(&mut self) -> u32 {
        *self.entry.get_or_insert_with(|| {
            *self.index.entry(self.name.clone()).or_insert_with(|| {
                self.names.push(self.name.clone());
                (self.names.len() - 1) as u32
            })
        })
    }

    /// The table.
    pub fn into_names(self) -> Vec<String> {
        self.names
    }
}
