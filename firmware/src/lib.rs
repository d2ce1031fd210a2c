//! The controller: one library for every board and for the virtual controller on the host.
#![no_std]
#![forbid(unsafe_code)]
