//! A cause of the whole machine beside the same cause of one slide: two ways to say what each slide has.
use super::explained::{Explained, refit};
use super::hypothesis::Kind;
use super::tangent;
use crate::causes::{Cause, Seat, Site};

/// Gives each slide its own size where a cause was chosen both for the machine and for one of its slides: a person measures and
/// sets slides, and "all by 7 and Y by another 65" is no figure of any of them.
pub(super) fn split(found: &mut Explained) {
    for machine in found.chosen.clone() {
        let Some((cause, Site::Machine)) = cause_of(found, machine) else {
            continue;
        };
        let of_slide = |item: &usize| matches!(cause_of(found, *item), Some((other, Site::One(_))) if other == cause);
        if cause.model().seat() != Seat::MachineOrOne || !found.chosen.iter().any(of_slide) {
            continue;
        }
        let slides: Vec<usize> = (0..found.items.len())
            .filter(|item| of_slide(item))
            .collect();
        let kept = found
            .chosen
            .iter()
            .copied()
            .filter(|item| *item != machine && !of_slide(item));
        found.chosen = kept.chain(slides).collect();
        let all = found.all();
        refit(found, &all);
        tangent::finish(found, &all);
    }
}

fn cause_of(found: &Explained, item: usize) -> Option<(Cause, Site)> {
    match &found.items[item].kind {
        Kind::Cause { cause, site, .. } => Some((*cause, *site)),
        Kind::Pattern(_) => None,
    }
}
