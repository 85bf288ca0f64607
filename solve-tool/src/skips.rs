//! Work that is not done, because what it would give is known: each kind has a name, a proof where it is done, a counter
//! in the report, and can be switched off with `--no-skip`.

/// A kind of work that is left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Skip {
    /// Components of the visibility graph without emission: B = 0
    UnlitComponents,
    /// Components of the visibility graph are solved one by one
    ComponentsApart,
    /// Channels that are equal, or equal but for a factor, are solved once
    EqualChannels,
    /// Entries between elements that reflect nothing or do not emit take no part in a product
    BlackRows,
    /// Steps after the bound has met the tolerance
    EarlyStop,
    /// Steps that find the constant mode, which the energy balance gives
    ConstantMode,
}

impl Skip {
    /// The name on the command line.
    pub fn name(self) -> String {
        let value = clap::ValueEnum::to_possible_value(&self);
        value.map_or_else(String::new, |value| value.get_name().to_owned())
    }
}

/// Which kinds are left out.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Skips {
    /// Kinds that are done all the same.
    pub done: Vec<Skip>,
}

impl Skips {
    /// Whether work of this kind is left out.
    pub fn has(&self, skip: Skip) -> bool {
        !self.done.contains(&skip)
    }
}
