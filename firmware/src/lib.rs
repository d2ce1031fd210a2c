//! The controller: one library for every board and for the virtual controller on the host.
//!
//! | module | holds | knows nothing of |
//! |---|---|---|
//! | [`engine`] | programs in, set-points out, one a tick | links, flash |
//! | [`control`] | the engine split between interrupt and background | registers |
//! | [`pulses`] | step and direction, out and in | pins |
//! | [`stm32_flash`] | the flash controller of a part, testable on the host | what is stored |
//! | [`store`] | two slots of flash, confirmations, power cuts | what a table means |
//! | [`server`] | the protocol state machine: request in, reply out | registers, serial ports |
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod control;
pub mod engine;
pub mod pulses;
pub mod server;
pub mod stm32_flash;
pub mod store;
