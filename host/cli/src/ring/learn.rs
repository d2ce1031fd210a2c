//! From the campaign to a table.
use super::DemoError;
use giotto::analysis::{self, Report};
use giotto::campaign::Campaign;
use giotto::diagnosis::{self, Diagnosis, diagnose};
use giotto::fit::{self, Observation, RadiusFit};
use giotto::simulation::{self, Plan};
use giotto::table_from_model::{ModelTable, table_from_model};
use giotto_shared::table::{self, MAX_IMAGE_BYTES, Table};

/// What a campaign teaches.
#[derive(Clone, Debug)]
pub struct Learned {
    /// The campaign.
    pub campaign: Campaign,
    /// Its circles.
    pub report: Report,
    /// The radius model, Eq. 15.
    pub fit: RadiusFit,
    /// What one servo lag gets wrong, and the model extended by that.
    pub diagnosis: Diagnosis,
    /// The extended model as the controller takes it.
    pub table: ModelTable,
}

/// Runs the plan and learns from what its instrument read; nothing here knows the machine.
///
/// # Errors
/// [`DemoError`]; none of the controller.
pub fn learn(plan: &Plan, seed: u64) -> Result<Learned, DemoError> {
    let campaign = simulation::campaign(plan, seed);
    let report = analysis::of_campaign(&campaign).map_err(|(_, error)| error)?;
    let observation = |run: &analysis::RunAnalysis| Observation {
        radius_m: run.radius_m,
        feed_m_s: run.feed_m_s,
        radius_error_m: run.radius_error_m,
        out_of_roundness_m: Some(run.out_of_roundness_m),
    };
    let observations: Vec<Observation> = report.runs.iter().map(observation).collect();
    let fit = RadiusFit::new(&observations, fit::Options::default())?;
    let diagnosis = diagnose(
        &campaign,
        &diagnosis::Options {
            seed,
            ..diagnosis::Options::default()
        },
    )?;
    if !diagnosis.worth_writing {
        return Err(DemoError::NotProven);
    }
    let table = table_from_model(&diagnosis.model)?;
    Ok(Learned {
        campaign,
        report,
        fit,
        diagnosis,
        table,
    })
}

/// The table in the form in which it is flashed.
pub(crate) fn image(table: &Table) -> Result<Vec<u8>, DemoError> {
    let mut image = vec![0; MAX_IMAGE_BYTES];
    let length = table::encode(table, &mut image)?;
    image.truncate(length);
    Ok(image)
}
