//! Rows of different lengths in two flat arrays, as they lie in a file: `start[i]..start[i + 1]` are the places of row `i`.

use bytemuck::Pod;

/// Rows of different lengths: `start` has one entry more than there are rows, begins with 0 and never falls.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ragged<T> {
    start: Vec<u32>,
    values: Vec<T>,
}

impl<T> Default for Ragged<T> {
    fn default() -> Self {
        Self { start: vec![0], values: Vec::new() }
    }
}

impl<T: Pod> Ragged<T> {
    /// Rows from their two arrays, or the reason why these are none.
    pub fn from_parts(start: Vec<u32>, values: Vec<T>) -> Result<Self, String> {
        if start.first() != Some(&0) {
            return Err("row starts do not begin with 0".into());
        }
        if let Some(i) = start.windows(2).position(|pair| pair[0] > pair[1]) {
            return Err(format!("row {i} ends before it starts"));
        }
        let end = start.last().map_or(0, |&end| end as usize);
        if end != values.len() {
            return Err(format!("rows end at {end}, but there are {} values", values.len()));
        }
        Ok(Self { start, values })
    }

    /// Adds a row.
    pub fn push(&mut self, row: impl IntoIterator<Item = T>) {
        self.values.extend(row);
        self.start.push(self.values.len() as u32);
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.start.len() - 1
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Row `i`; `i < len()`.
    pub fn row(&self, i: usize) -> &[T] {
        &self.values[self.start[i] as usize..self.start[i + 1] as usize]
    }

    /// All rows in order.
    pub fn rows(&self) -> impl Iterator<Item = &[T]> {
        (0..self.len()).map(|i| self.row(i))
    }

    /// The array of row starts.
    pub fn starts(&self) -> &[u32] {
        &self.start
    }

    /// All values, row after row.
    pub fn values(&self) -> &[T] {
        &self.values
    }
}

impl<T: Pod> FromIterator<Vec<T>> for Ragged<T> {
    fn from_iter<I: IntoIterator<Item = Vec<T>>>(rows: I) -> Self {
        let mut ragged = Self::default();
        for row in rows {
            ragged.push(row);
        }
        ragged
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_back_and_bad_parts_are_refused() {
        let rows: Ragged<u32> = vec![vec![1, 2, 3], vec![], vec![4]].into_iter().collect();
        assert_eq!(
            rows.rows().map(<[u32]>::to_vec).collect::<Vec<_>>(),
            vec![vec![1, 2, 3], vec![], vec![4]]
        );
        assert_eq!(Ragged::from_parts(rows.starts().to_vec(), rows.values().to_vec()), Ok(rows));
        assert!(Ragged::<u32>::from_parts(vec![], vec![]).is_err());
        assert!(Ragged::from_parts(vec![0, 2, 1], vec![1u32]).is_err());
        assert!(Ragged::from_parts(vec![0, 2], vec![1u32]).is_err());
    }
}
