//! Pins and parameters. A pin is a pointer in memory of HAL's, to where its value is: HAL moves it when it is connected.
use crate::hal;
use crate::page::Name;
use core::ffi::c_int;
use giotto_corrector::{Input, JOINTS, Output};

/// What belongs to a joint.
#[repr(C)]
struct Joint {
    command_in: *mut f64,
    command_out: *mut f64,
    feedback_in: *mut f64,
    feedback_out: *mut f64,
    motor_offset: *mut f64,
    soft: [f64; 2],
}

/// All pins, in memory of HAL's.
#[repr(C)]
pub(crate) struct Pins {
    joints: usize,
    joint: [Joint; JOINTS],
    enable: *mut bool,
    coordinated: *mut bool,
    machine_on: *mut bool,
    active: *mut bool,
    fault: *mut bool,
    stop: *mut bool,
    cuts: *mut u32,
    latency_s: *mut f64,
}

/// Soft limits if none are set, machine units.
const UNLIMITED: f64 = 1e99;

/// Makes the pins; the error is HAL's.
///
/// # Safety
/// `id` is the component's, and it is not ready yet.
pub(crate) unsafe fn make(id: c_int, joints: usize) -> Result<*mut Pins, c_int> {
    // SAFETY: memory of HAL's that is large enough and lasts as long as the component; every pointer is set before it is used.
    unsafe {
        let pins: *mut Pins = hal::hal_malloc(size_of::<Pins>() as _).cast();
        if pins.is_null() {
            return Err(-12);
        }
        core::ptr::write_bytes(pins, 0, 1);
        let p = &mut *pins;
        p.joints = joints;
        let done = |result: c_int| if result == 0 { Ok(()) } else { Err(result) };
        for (number, joint) in p.joint.iter_mut().enumerate().take(joints) {
            let float = |end: &str, way, pin: *mut *mut f64| {
                done(hal::hal_pin_float_new(
                    Name::of_joint(number, end).as_ptr(),
                    way,
                    pin,
                    id,
                ))
            };
            float("in", hal::IN, &mut joint.command_in)?;
            float("out", hal::OUT, &mut joint.command_out)?;
            float("fb-in", hal::IN, &mut joint.feedback_in)?;
            float("fb-out", hal::OUT, &mut joint.feedback_out)?;
            float("motor-offset", hal::IN, &mut joint.motor_offset)?;
            joint.soft = [-UNLIMITED, UNLIMITED];
            for (end, limit) in ["min", "max"].into_iter().zip(&mut joint.soft) {
                let name = Name::of_joint(number, end);
                done(hal::hal_param_float_new(
                    name.as_ptr(),
                    hal::READ_WRITE,
                    limit,
                    id,
                ))?;
            }
        }
        let bits = [
            (c"giotto.enable", hal::IN, &raw mut p.enable, false),
            (c"giotto.coordinated", hal::IN, &raw mut p.coordinated, true),
            (c"giotto.machine-on", hal::IN, &raw mut p.machine_on, true),
            (c"giotto.active", hal::OUT, &raw mut p.active, false),
            (c"giotto.fault", hal::OUT, &raw mut p.fault, false),
            (c"giotto.stop", hal::OUT, &raw mut p.stop, false),
        ];
        for (name, way, pin, value) in bits {
            done(hal::hal_pin_bit_new(name.as_ptr(), way, pin, id))?;
            **pin = value;
        }
        done(hal::hal_pin_u32_new(
            c"giotto.cuts".as_ptr(),
            hal::OUT,
            &mut p.cuts,
            id,
        ))?;
        done(hal::hal_pin_float_new(
            c"giotto.latency-s".as_ptr(),
            hal::OUT,
            &mut p.latency_s,
            id,
        ))?;
        Ok(pins)
    }
}

impl Pins {
    /// What stands at the inputs.
    ///
    /// # Safety
    /// In the real-time thread.
    pub(crate) unsafe fn read(&self) -> Input {
        let mut input = Input {
            command: [0.0; JOINTS],
            feedback: [0.0; JOINTS],
            motor_offset: [0.0; JOINTS],
            soft: [[0.0; 2]; JOINTS],
            enable: false,
            coordinated: false,
            machine_on: false,
        };
        // SAFETY: all pins of the joints in use were made; others may write them meanwhile, hence volatile.
        unsafe {
            let places = input.command.iter_mut().zip(&mut input.feedback);
            let rest = input.motor_offset.iter_mut().zip(&mut input.soft);
            for ((joint, (command, feedback)), (offset, soft)) in
                self.joint.iter().take(self.joints).zip(places).zip(rest)
            {
                *command = joint.command_in.read_volatile();
                *feedback = joint.feedback_in.read_volatile();
                *offset = joint.motor_offset.read_volatile();
                *soft = (&raw const joint.soft).read_volatile();
            }
            input.enable = self.enable.read_volatile();
            input.coordinated = self.coordinated.read_volatile();
            input.machine_on = self.machine_on.read_volatile();
        }
        input
    }

    /// Sets the outputs.
    ///
    /// # Safety
    /// In the real-time thread.
    pub(crate) unsafe fn write(&self, output: &Output, cuts: u32, stop: bool) {
        // SAFETY: as in `read`.
        unsafe {
            let places = output.command.iter().zip(&output.feedback);
            for (joint, (command, feedback)) in self.joint.iter().take(self.joints).zip(places) {
                joint.command_out.write_volatile(*command);
                joint.feedback_out.write_volatile(*feedback);
            }
            self.active.write_volatile(output.active);
            self.fault.write_volatile(output.fault);
            self.stop.write_volatile(stop);
            self.cuts.write_volatile(cuts);
            self.latency_s.write_volatile(output.latency_s);
        }
    }
}
