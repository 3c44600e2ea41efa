//! The settings of a scene's physics, for those that know their types.

use std::any::Any;

/// Settings by the table of the scene that each is of: its own tables first, then those of single nodes.
#[derive(Default)]
pub struct Tables<'s>(pub Vec<(String, &'s dyn Any)>);

impl<'s> Tables<'s> {
    /// All settings of a type, with the table that each is of: `NAME`, or `nodes.NAME` of a node's own.
    pub fn each<S: 'static>(&self) -> impl Iterator<Item = (&str, &'s S)> {
        self.0.iter().filter_map(|(table, settings)| Some((table.as_str(), settings.downcast_ref()?)))
    }

    /// The settings of a type that a table of the scene has, not those of a single node.
    #[must_use]
    pub fn main<S: 'static>(&self) -> Option<&'s S> {
        self.each().find(|(table, _)| !table.contains('.')).map(|(_, settings)| settings)
    }
}
