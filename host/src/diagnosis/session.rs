//! What a session brought, made ready: one override for all taken in, a spoilt run left out.
use super::influence::{self, LeftOut};
use super::survey::{self, Survey};
use super::{Options, angular_bins, arm, duration, feed_override, other_way};
use crate::campaign::Campaign;

/// What a session brought, made ready: one override for all taken in, a spoilt run left out.
pub(super) struct Session {
    pub(super) campaign: Campaign,
    pub(super) survey: Survey,
    /// Index in the given campaign of each run looked at.
    pub(super) places: Vec<usize>,
    pub(super) notes: Vec<String>,
    pub(super) left_out: Vec<LeftOut>,
}

/// One run in so many may be spoilt.
const ONE_SPOILT_IN: usize = 12;

impl Session {
    pub(super) fn of(campaign: &Campaign, options: &Options) -> Self {
        let mut notes = Vec::new();
        let mut campaign = match feed_override::find(campaign) {
            Some(factor) => {
                notes.push(feed_override::words(factor));
                feed_override::applied(campaign, factor)
            }
            None => campaign.clone(),
        };
        let mut places: Vec<usize> = (0..campaign.runs.len()).collect();
        let mut left_out = Vec::new();
        let mut survey = Survey::new(&campaign);
        let most = if options.keep_all {
            0
        } else {
            (campaign.runs.len() / ONE_SPOILT_IN).max(1)
        };
        while left_out.len() < most {
            // A label that the clock or the set-up contradicts says so more plainly than what follows from it.
            let mislabelled = |run: usize| (run, duration::reason(&campaign.runs[run]));
            let Some((index, reason)) = duration::contradicted(&campaign)
                .map(mislabelled)
                .or_else(|| driven_the_other_way(&survey))
                .or_else(|| spoilt_of(&campaign, &survey, options))
            else {
                break;
            };
            let run = campaign.runs.remove(index);
            places.remove(index);
            left_out.push(LeftOut {
                file: run.file,
                reason,
            });
            survey = Survey::new(&campaign);
        }
        Self {
            campaign,
            survey,
            places,
            notes,
            left_out,
        }
    }
}

/// A run with the label of the other direction, and why.
fn driven_the_other_way(survey: &Survey) -> Option<(usize, String)> {
    let reason = "its set-up offset lies with that of all others only if it was driven the other way round than its label says";
    Some((other_way::find(survey)?, reason.to_owned()))
}

/// A run that is far from what the others foretell, and why.
fn spoilt_of(campaign: &Campaign, survey: &Survey, options: &Options) -> Option<(usize, String)> {
    let response = match &options.model {
        Some(model) => model.servo.response(),
        None => arm::fit_lag_of(campaign),
    };
    let (runs, _) = survey.prepare(&response, 0.0);
    let data = survey::misfit(&runs);
    let profiles = angular_bins::bin_means(&runs, &data);
    let means: Vec<f64> = runs
        .iter()
        .zip(data.low())
        .map(|(run, low)| low[0] / (run.visible().max(1) as f64).sqrt())
        .collect();
    let spoilt = influence::find(&runs, &profiles, &means)?;
    Some((spoilt.run, influence::reason(&spoilt)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::{self, Plan};
    use std::path::Path;

    fn campaign() -> Campaign {
        let plan = "[machine]\nboth = { kv_per_s = 50.0 }\nsquareness_um_per_m = 60.0\n\
             [grid]\nradii_mm = [50.0, 100.0, 150.0]\nfeeds_mm_s = [20.0, 100.0, 300.0]\n\
             [instrument]\nsetup_um = [20.0, -10.0]";
        let plan = Plan::parse(plan, Path::new("plan.toml")).unwrap();
        simulation::campaign(&plan, 1)
    }

    fn left_out(campaign: &Campaign, options: &Options) -> Vec<(String, String)> {
        let session = Session::of(campaign, options);
        let left = session.left_out.into_iter();
        left.map(|out| (out.file, out.reason)).collect()
    }

    #[test]
    fn labels_that_are_right_stay() {
        assert_eq!(left_out(&campaign(), &Options::default()), []);
    }

    #[test]
    fn a_run_of_the_other_direction_is_left_out_whichever_it_is() {
        let sound = campaign();
        assert!(sound.runs.iter().all(|run| run.samples.angle_inferred));
        let mut by_set_up = 0;
        for index in 0..sound.runs.len() {
            let mut wrong = sound.clone();
            let run = &mut wrong.runs[index];
            run.direction = run.direction.reversed();
            run.samples
                .angle_rad
                .iter_mut()
                .for_each(|angle| *angle = -*angle);
            let out = left_out(&wrong, &Options::default());
            assert_eq!(out.len(), 1, "{index}: {out:?}");
            assert_eq!(out[0].0, sound.runs[index].file);
            // What the run does not share with the others may tell it first.
            by_set_up += usize::from(out[0].1.contains("other way round"));
            let keep_all = Options {
                keep_all: true,
                ..Options::default()
            };
            assert_eq!(left_out(&wrong, &keep_all), []);
        }
        assert!(2 * by_set_up > sound.runs.len(), "{by_set_up}");
    }

    #[test]
    fn a_label_that_the_clock_contradicts_is_left_out() {
        let sound = campaign();
        for (index, factor) in [(0, 2.5), (5, 0.4), (11, 1.5), (17, 0.8)] {
            let mut wrong = sound.clone();
            wrong.runs[index].feed_m_s *= factor;
            let out = left_out(&wrong, &Options::default());
            assert_eq!(out.len(), 1, "{index}: {out:?}");
            assert_eq!(out[0].0, sound.runs[index].file);
            assert!(out[0].1.contains("its turn lasted"), "{out:?}");
        }
    }
}
