//! What is searched.

use std::collections::BTreeMap;

/// One technique with all its settings, as the search knows it.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Name of the technique.
    pub technique: String,
    /// The preset that the settings started from.
    pub preset: Option<String>,
    /// The settings that have an effect, and their values as on the command line.
    pub settings: BTreeMap<String, String>,
    /// The settings of which a larger value costs more, all else alike.
    pub amounts: Vec<String>,
    /// Settings that differ from the preset's.
    pub changes: usize,
}

impl Candidate {
    fn amount(&self, name: &str) -> Option<f64> {
        self.settings
            .get(name)?
            .parse()
            .ok()
            .filter(|amount| *amount > 0.0)
    }

    /// The product of all amounts: what has less of each has less.
    pub(super) fn total_amount(&self) -> f64 {
        self.amounts
            .iter()
            .filter_map(|name| self.amount(name))
            .product()
    }

    /// Whether it is the other one in another technique: the same preset, and the same values of
    /// all settings that both have, but the amounts.
    pub(super) fn is_elsewhere(&self, other: &Candidate) -> bool {
        let is_alike = |(name, value): (&String, &String)| {
            (other.settings.get(name)).is_none_or(|others| others == value)
                || self.amounts.contains(name)
        };
        self.technique != other.technique
            && self.preset == other.preset
            && self.changes == other.changes
            && self.settings.iter().all(is_alike)
    }

    /// Whether it is the other one with less of some amount and more of none.
    pub(super) fn is_less(&self, other: &Candidate) -> bool {
        let is_no_more = |name: &String| {
            self.amount(name)
                .zip(other.amount(name))
                .is_some_and(|(less, more)| less <= more)
        };
        let is_alike = |(name, value): (&String, &String)| {
            other.settings.get(name) == Some(value) || self.amounts.contains(name)
        };
        self.technique == other.technique
            && self.amounts == other.amounts
            && self.settings.len() == other.settings.len()
            && self.settings.iter().all(is_alike)
            && self.amounts.iter().all(is_no_more)
    }
}
