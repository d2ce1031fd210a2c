//! A machine made of LinuxCNC's own components, and the files that start it.
//!
//! ```text
//! joint.N.motor-pos-cmd → giotto.N → play (sum2, deadzone) → average (a chain of sum2) → lag (lowpass) → scale → measured
//!                                                                                                      → giotto.N.fb-in
//! ```
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
/// Of each axis, mm/s and mm/s².
const FEED: f64 = 800.0;
const ACCELERATION: f64 = 10_000.0;
/// Soft limits, mm.
const LIMIT: f64 = 500.0;

/// LinuxCNC's configuration.
pub(super) fn ini() -> String {
    let mut out = format!(
        "[EMC]\nVERSION = 1.1\nMACHINE = giotto-scenario\nDEBUG = 0\n\
         [DISPLAY]\nDISPLAY = ./driver.py\n\
         [TASK]\nTASK = milltask\nCYCLE_TIME = 0.005\n\
         [RS274NGC]\nPARAMETER_FILE = machine.var\n\
         [EMCMOT]\nEMCMOT = motmod\nCOMM_TIMEOUT = 4.0\nSERVO_PERIOD = 1000000\n\
         [HAL]\nHALFILE = machine.hal\n\
         [EMCIO]\nEMCIO = io\nCYCLE_TIME = 0.1\n\
         [TRAJ]\nCOORDINATES = X Y Z\nLINEAR_UNITS = mm\nANGULAR_UNITS = degree\nDEFAULT_LINEAR_VELOCITY = 50\n\
         MAX_LINEAR_VELOCITY = {FEED}\nMAX_LINEAR_ACCELERATION = {ACCELERATION}\nNO_FORCE_HOMING = 1\n\
         [KINS]\nKINEMATICS = trivkins coordinates=XYZ\nJOINTS = {AXES}\n"
    );
    for (joint, axis) in ["X", "Y", "Z"].into_iter().enumerate() {
        let limits = format!(
            "MIN_LIMIT = -{LIMIT}\nMAX_LIMIT = {LIMIT}\nMAX_VELOCITY = {FEED}\nMAX_ACCELERATION = {ACCELERATION}\n"
        );
        // Writing to a String does not fail.
        let _ = write!(
            out,
            "[AXIS_{axis}]\n{limits}[JOINT_{joint}]\nTYPE = LINEAR\nHOME = 0\n{limits}\
             FERROR = 40\nMIN_FERROR = 40\nHOME_SEARCH_VEL = 0\nHOME_LATCH_VEL = 0\nHOME_SEQUENCE = 0\n"
        );
    }
    out
}

/// Its HAL.
pub(super) fn hal() -> String {
    // By axis: difference and sum of the play, the average's chain, its difference and sum.
    let per_axis = 2 + AVERAGE_TICKS + 2;
    let sum = |axis: usize, k: usize| format!("sum2.{}", axis * per_axis + k);
    let mut out = format!(
        "loadrt [KINS]KINEMATICS\n\
         loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS\n\
         loadrt giotto joints={AXES}\n\
         loadrt sum2 count={}\nloadrt deadzone count={AXES}\nloadrt lowpass count={AXES}\nloadrt scale count={AXES}\n\
         loadrt sampler depth=40000 cfg=ffffffs\nsetp sampler.0.enable 0\n\
         addf motion-command-handler servo-thread\naddf motion-controller servo-thread\naddf giotto.update servo-thread\n",
        AXES * per_axis
    );
    let mut line = |text: String| {
        out += &text;
        out.push('\n');
    };
    let gain = 1.0 - (-TICK_S / LAG_S).exp();
    for axis in 0..AXES {
        let (gap, place) = (sum(axis, 0), sum(axis, 1));
        let chain: Vec<String> = (0..AVERAGE_TICKS).map(|k| sum(axis, 2 + k)).collect();
        let (change, average) = (sum(axis, 2 + AVERAGE_TICKS), sum(axis, 3 + AVERAGE_TICKS));
        line(format!(
            "net cmd{axis} joint.{axis}.motor-pos-cmd => giotto.{axis}.in sampler.0.pin.{axis}"
        ));
        line(format!(
            "net moff{axis} joint.{axis}.motor-offset => giotto.{axis}.motor-offset"
        ));
        line(format!(
            "setp giotto.{axis}.min -{LIMIT}\nsetp giotto.{axis}.max {LIMIT}"
        ));
        // The place follows once the gap is used up.
        line(format!("net out{axis} giotto.{axis}.out => {gap}.in0"));
        line(format!(
            "setp {gap}.gain1 -1\nsetp deadzone.{axis}.threshold {PLAY_MM}"
        ));
        line(format!("net gap{axis} {gap}.out => deadzone.{axis}.in"));
        line(format!("net pull{axis} deadzone.{axis}.out => {place}.in1"));
        line(format!(
            "net play{axis} {place}.out => {place}.in0 {gap}.in1 {}.in0 {change}.in0",
            chain[0]
        ));
        for (k, pair) in chain.windows(2).enumerate() {
            line(format!(
                "net tap{axis}-{k} {}.out => {}.in0",
                pair[0], pair[1]
            ));
        }
        let share = 1.0 / AVERAGE_TICKS as f64;
        line(format!(
            "setp {change}.gain0 {share}\nsetp {change}.gain1 -{share}"
        ));
        line(format!(
            "net oldest{axis} {}.out => {change}.in1",
            chain[AVERAGE_TICKS - 1]
        ));
        line(format!("net change{axis} {change}.out => {average}.in1"));
        line(format!(
            "net mean{axis} {average}.out => {average}.in0 lowpass.{axis}.in"
        ));
        line(format!("setp lowpass.{axis}.gain {gain:.9}"));
        line(format!(
            "net lag{axis} lowpass.{axis}.out => scale.{axis}.in"
        ));
        let scale = if axis == 0 { 1.0 + SCALE_X } else { 1.0 };
        line(format!("setp scale.{axis}.gain {scale}"));
        line(format!(
            "net at{axis} scale.{axis}.out => giotto.{axis}.fb-in sampler.0.pin.{}",
            axis + AXES
        ));
        line(format!(
            "net fb{axis} giotto.{axis}.fb-out => joint.{axis}.motor-pos-fb"
        ));
        let order = [gap, format!("deadzone.{axis}"), place, change, average];
        // The chain from its end: each takes what the one before had in the last tick.
        let order = order.into_iter().chain(chain.into_iter().rev());
        for part in order.chain([format!("lowpass.{axis}"), format!("scale.{axis}")]) {
            line(format!("addf {part} servo-thread"));
        }
    }
    line(format!(
        "net kind motion.motion-type => sampler.0.pin.{}",
        2 * AXES
    ));
    line("addf sampler.0 servo-thread".to_owned());
    line("net on motion.motion-enabled => giotto.machine-on".to_owned());
    line("net coordinated motion.coord-mode => giotto.coordinated".to_owned());
    line("net estop iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in".to_owned());
    line("net prepare iocontrol.0.tool-prepare => iocontrol.0.tool-prepared".to_owned());
    line("net change iocontrol.0.tool-change => iocontrol.0.tool-changed".to_owned());
    out
}
