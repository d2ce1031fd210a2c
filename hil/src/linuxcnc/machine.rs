//! A machine made of LinuxCNC's own components, and the files that start it.
//!
//! ```text
//! joint.N.motor-pos-cmd → giotto.N → play (sum2, deadzone) → average (a chain of sum2) → lag (lowpass) → scale → measured
//!                                                                                                      → giotto.N.fb-in
//! ```
//! The play lies ahead of the servo, as that of LinuxCNC's own BACKLASH and of a slide that is measured directly, or behind it,
//! between lag and scale, as that of a screw that nothing measures.
use std::fmt::Write as _;

/// Axes.
pub(super) const AXES: usize = 3;
/// Servo period, s: a tick of the samples.
pub(super) const TICK_S: f64 = 1e-3;
/// Lag of each axis, s.
const LAG_S: f64 = 0.020;
/// Ticks of the moving average.
const AVERAGE_TICKS: usize = 40;
/// Play of each axis, mm.
const PLAY_MM: f64 = 0.020;
/// X is long by this share.
const SCALE_X: f64 = 1.5e-4;
/// Highest feed of each axis, mm/s.
const FEED: f64 = 800.0;
/// What each drive can do, mm/s². A correction pulls harder than the path where a line meets an arc, and harder still in a
/// corner: the drive has to have that to give.
pub(super) const DRIVE: f64 = 30_000.0;
/// What LinuxCNC may ask of each axis, mm/s².
pub(super) const ACCELERATION: f64 = 10_000.0;
/// Soft limits, mm.
const LIMIT: f64 = 500.0;

/// Where the play lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Play {
    /// Ahead of the servo.
    #[default]
    Ahead,
    /// Behind it.
    Behind,
}

/// LinuxCNC's configuration; `acceleration`: the planner's, mm/s².
pub(super) fn ini(acceleration: f64) -> String {
    let mut out = format!(
        "[EMC]\nVERSION = 1.1\nMACHINE = giotto-scenario\nDEBUG = 0\n\
         [DISPLAY]\nDISPLAY = ./driver.py\n\
         [TASK]\nTASK = milltask\nCYCLE_TIME = 0.005\n\
         [RS274NGC]\nPARAMETER_FILE = machine.var\n\
         [EMCMOT]\nEMCMOT = motmod\nCOMM_TIMEOUT = 4.0\nSERVO_PERIOD = 1000000\n\
         [HAL]\nHALFILE = machine.hal\nHALUI = halui\n\
         [EMCIO]\nEMCIO = io\nCYCLE_TIME = 0.1\n\
         [TRAJ]\nCOORDINATES = X Y Z\nLINEAR_UNITS = mm\nANGULAR_UNITS = degree\nDEFAULT_LINEAR_VELOCITY = 50\n\
         MAX_LINEAR_VELOCITY = {FEED}\nMAX_LINEAR_ACCELERATION = {acceleration}\nNO_FORCE_HOMING = 1\n\
         [KINS]\nKINEMATICS = trivkins coordinates=XYZ\nJOINTS = {AXES}\n"
    );
    for (joint, axis) in ["X", "Y", "Z"].into_iter().enumerate() {
        let limits = format!(
            "MIN_LIMIT = -{LIMIT}\nMAX_LIMIT = {LIMIT}\nMAX_VELOCITY = {FEED}\nMAX_ACCELERATION = {acceleration}\n"
        );
        // Writing to a String does not fail.
        let _ = write!(
            out,
            "[AXIS_{axis}]\n{limits}[JOINT_{joint}]\nTYPE = LINEAR\nHOME = 0\n{limits}\
             STEPGEN_MAXACCEL = {DRIVE}\nFERROR = 40\nMIN_FERROR = 40\nHOME_SEARCH_VEL = 0\nHOME_LATCH_VEL = 0\nHOME_SEQUENCE = 0\n"
        );
    }
    out
}

/// Names of the parts of one axis.
struct Parts {
    axis: usize,
    gap: String,
    place: String,
    chain: Vec<String>,
    change: String,
    average: String,
    touched: String,
}

/// `sum2`s of an axis: two of the play, the average's chain, its difference and sum, what was added.
const SUMS: usize = 2 + AVERAGE_TICKS + 3;

impl Parts {
    fn new(axis: usize) -> Self {
        let sum = |k: usize| format!("sum2.{}", axis * SUMS + k);
        Self {
            axis,
            gap: sum(0),
            place: sum(1),
            chain: (0..AVERAGE_TICKS).map(|k| sum(2 + k)).collect(),
            change: sum(2 + AVERAGE_TICKS),
            average: sum(3 + AVERAGE_TICKS),
            touched: sum(4 + AVERAGE_TICKS),
        }
    }

    /// Set-points through giotto, the feedback back through it, and a bit of what was added as large as a number.
    fn giotto(&self) -> String {
        let Self { axis, touched, .. } = self;
        format!(
            "setp giotto.{axis}.min -{LIMIT}\nsetp giotto.{axis}.max {LIMIT}\n\
             net cmd{axis} joint.{axis}.motor-pos-cmd => giotto.{axis}.in {touched}.in1 sampler.0.pin.{axis}\n\
             net moff{axis} joint.{axis}.motor-offset => giotto.{axis}.motor-offset\n\
             net out{axis} giotto.{axis}.out => {touched}.in0\n\
             setp {touched}.gain0 {LOUD}\nsetp {touched}.gain1 -{LOUD}\n\
             net touched{axis} {touched}.out => sampler.0.pin.{}\n\
             net fb{axis} giotto.{axis}.fb-out => joint.{axis}.motor-pos-fb\n",
            2 * AXES + axis
        )
    }

    /// Play between two signals: the place follows once the gap is used up.
    fn play(&self, from: &str, to: &str) -> String {
        let Self {
            axis, gap, place, ..
        } = self;
        format!(
            "setp {gap}.gain1 -1\nsetp deadzone.{axis}.threshold {PLAY_MM}\n\
             net {from}{axis} => {gap}.in0\n\
             net gap{axis} {gap}.out => deadzone.{axis}.in\n\
             net pull{axis} deadzone.{axis}.out => {place}.in1\n\
             net {to}{axis} {place}.out => {place}.in0 {gap}.in1\n"
        )
    }

    /// Average and lag between two signals.
    fn servo(&self, from: &str, to: &str) -> String {
        let Self {
            axis,
            chain,
            change,
            average,
            ..
        } = self;
        let (share, gain) = (1.0 / AVERAGE_TICKS as f64, 1.0 - (-TICK_S / LAG_S).exp());
        let mut out = format!("net {from}{axis} => {}.in0 {change}.in0\n", chain[0]);
        for (k, pair) in chain.windows(2).enumerate() {
            let _ = writeln!(out, "net tap{axis}-{k} {}.out => {}.in0", pair[0], pair[1]);
        }
        out + &format!(
            "setp {change}.gain0 {share}\nsetp {change}.gain1 -{share}\n\
             net oldest{axis} {}.out => {change}.in1\n\
             net change{axis} {change}.out => {average}.in1\n\
             net mean{axis} {average}.out => {average}.in0 lowpass.{axis}.in\n\
             setp lowpass.{axis}.gain {gain:.9}\nnet {to}{axis} lowpass.{axis}.out\n",
            chain[AVERAGE_TICKS - 1]
        )
    }

    /// The scale, and what is measured.
    fn scale(&self, from: &str) -> String {
        let axis = self.axis;
        let scale = if axis == 0 { 1.0 + SCALE_X } else { 1.0 };
        format!(
            "net {from}{axis} => scale.{axis}.in\nsetp scale.{axis}.gain {scale}\n\
             net at{axis} scale.{axis}.out => giotto.{axis}.fb-in sampler.0.pin.{}\n",
            axis + AXES
        )
    }

    /// The parts in the order of their work.
    fn order(&self, play: Play) -> Vec<String> {
        let axis = self.axis;
        let gap = [
            self.gap.clone(),
            format!("deadzone.{axis}"),
            self.place.clone(),
        ];
        // The chain from its end: each takes what the one before had in the last tick.
        let servo = [self.change.clone(), self.average.clone()]
            .into_iter()
            .chain(self.chain.iter().rev().cloned())
            .chain([format!("lowpass.{axis}")]);
        let mut order = vec![self.touched.clone()];
        match play {
            Play::Ahead => order.extend(gap.into_iter().chain(servo)),
            Play::Behind => order.extend(servo.chain(gap)),
        }
        order.push(format!("scale.{axis}"));
        order
    }
}

/// What is added is sampled times this, so that its last bit shows among the digits.
pub(super) const LOUD: f64 = 1e15;

/// Its HAL.
pub(super) fn hal(play: Play) -> String {
    let mut out = format!(
        "loadrt [KINS]KINEMATICS\n\
         loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS\n\
         loadrt giotto joints={AXES}\n\
         loadrt sum2 count={}\nloadrt deadzone count={AXES}\nloadrt lowpass count={AXES}\nloadrt scale count={AXES}\n\
         loadrt sampler depth=40000 cfg=fffffffffs\nsetp sampler.0.enable 0\n\
         addf motion-command-handler servo-thread\naddf motion-controller servo-thread\naddf giotto.update servo-thread\n",
        AXES * SUMS
    );
    for axis in 0..AXES {
        let parts = Parts::new(axis);
        out += &parts.giotto();
        out += &match play {
            Play::Ahead => [parts.play("out", "play"), parts.servo("play", "drive")].concat(),
            Play::Behind => [parts.servo("out", "drive"), parts.play("drive", "play")].concat(),
        };
        out += &parts.scale(match play {
            Play::Ahead => "drive",
            Play::Behind => "play",
        });
        for part in parts.order(play) {
            let _ = writeln!(out, "addf {part} servo-thread");
        }
    }
    let kind = 3 * AXES;
    out + &format!(
        "net kind motion.motion-type => sampler.0.pin.{kind}\naddf sampler.0 servo-thread\n\
         net on motion.motion-enabled => giotto.machine-on\n\
         net coordinated motion.coord-mode => giotto.coordinated\n\
         net estop iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in\n\
         net prepare iocontrol.0.tool-prepare => iocontrol.0.tool-prepared\n\
         net change iocontrol.0.tool-change => iocontrol.0.tool-changed\n\
         net giotto-stop giotto.stop => halui.abort\n"
    )
}
