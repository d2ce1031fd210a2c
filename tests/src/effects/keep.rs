//! Campaigns with fewer runs than they should have.
use giotto::campaign::Campaign;

/// What a laboratory without much time would have measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// One radius only.
    OneRadius,
    /// One feed only.
    OneFeed,
    /// One direction only.
    OneDirection,
    /// One run only.
    OneRun,
}

impl Keep {
    /// Leaves out the other runs; the first run decides which stay.
    pub fn thin(self, campaign: &mut Campaign) {
        let Some(first) = campaign.runs.first() else {
            return;
        };
        let (radius, feed, direction) = (first.radius_m, first.feed_m_s, first.direction);
        campaign.runs.retain(|r| match self {
            Self::OneRadius => r.radius_m == radius,
            Self::OneFeed => r.feed_m_s == feed,
            Self::OneDirection => r.direction == direction,
            Self::OneRun => true,
        });
        if self == Self::OneRun {
            campaign.runs.truncate(1);
        }
    }
}
