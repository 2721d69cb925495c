//! Ids of commands: two runs of a program give the same commands, but not with the same ids.

use std::sync::LazyLock;

use ft_transfer_area::transfer_area::MAX_AREAS;
use ft_transfer_area_recorder::{value_names, Cycle};

/// How often the ids of a recording have changed.
#[derive(Default)]
pub(super) struct Changes {
    /// By area and place: the last id, and how often it has changed.
    ids: [Vec<(i32, i32)>; MAX_AREAS],
}

impl Changes {
    /// The values of an area, with the number of changes in place of each id.
    pub(super) fn values(&mut self, area: usize, cycle: &Cycle) -> Option<Vec<i32>> {
        let mut values = cycle.values(area)?;
        let ids = &mut self.ids[area];
        if cycle.first || ids.is_empty() {
            *ids = values.iter().map(|value| (*value, 0)).collect();
        }
        for place in &*PLACES {
            let (value, (last, changes)) = (&mut values[*place], &mut ids[*place]);
            *changes += i32::from(value != last);
            *last = *value;
            *value = *changes;
        }
        Some(values)
    }

    /// Counts from 0 again.
    pub(super) fn begin_again(&mut self) {
        self.ids.iter_mut().for_each(Vec::clear);
    }
}

/// Where the ids are.
static PLACES: LazyLock<Vec<usize>> = LazyLock::new(|| {
    let names = value_names().enumerate();
    names.filter(|(_, (_, name))| is_id(name)).map(|(place, _)| place).collect()
});

/// Whether a value is the id of a command or of a configuration.
pub(super) fn is_id(name: &str) -> bool {
    ["_command", "_done", "_reset", "config_id"].iter().any(|end| name.ends_with(end))
}
