//! Scenarios on the giotto controller: the image under QEMU, the virtual controller, or a real port.
#![forbid(unsafe_code)]

pub mod contour;
pub mod elf;
pub mod faults;
pub mod link;
pub mod linuxcnc;
pub mod planes;
pub mod programs;
pub mod rate;
pub mod scenarios;
pub mod size;
pub mod streams;
pub mod ticks;
