//! What a session brought, made ready: one override for all taken in, a spoilt run left out.
use super::influence::{self, LeftOut};
use super::survey::{self, Survey};
use super::{Options, angular_bins, arm, feed_override};
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
            let Some(spoilt) = spoilt_of(&campaign, &survey, options) else {
                break;
            };
            let run = campaign.runs.remove(spoilt.run);
            places.remove(spoilt.run);
            left_out.push(LeftOut {
                file: run.file,
                reason: influence::reason(&spoilt),
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

fn spoilt_of(campaign: &Campaign, survey: &Survey, options: &Options) -> Option<influence::Spoilt> {
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
    influence::find(&runs, &profiles, &means)
}
