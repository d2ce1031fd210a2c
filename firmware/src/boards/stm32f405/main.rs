//! Image for the STM32F405 as on Adafruit's Feather STM32F405 Express (12 MHz crystal); runs on QEMU's
//! `-machine netduinoplus2` as well, which has the same part.
//!
//! | pins | use |
//! |---|---|
//! | PB10, PB11 (TX, RX) | USART3, the host's link |
//! | PB6 (SCL) | USART1, set-points while a run is in progress, in the frames of the link |
//! | PC6 (D6) | USART6, the log, in defmt's encoding |
//! | PB13, PB15; PB14, PB9; PB8, PB7 | step and direction of X, Y, Z (`pulses`) |
//! | PC2 (D12), PC1 (D13), PC7 (D5) | enable, in position, fault (`outputs`) |
//! | PC3 (D11) | stop input: a closed contact to ground lets it run; open, or a broken wire, stops |
//!
//! Tables and key are in sectors 1 to 3 of the flash, between the vectors and the code. While one is erased the core stands still for
//! up to half a second, and so does the tick: it happens at rest only, its time is counted, and the watchdog waits for four. So with the configuration, in
//! sectors 10 and 11, for up to two seconds once in two hundred changes.
//!
//! **Never run on a real board**: what QEMU does not emulate (clock, flash, pins) follows the reference manual (RM0090) and
//! has been seen to fail as it should, never to work.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("an image for a board: build it for thumbv7em-none-eabihf");
}

#[cfg(target_os = "none")]
mod clock;
#[cfg(target_os = "none")]
#[path = "../common/mod.rs"]
mod common;
#[cfg(target_os = "none")]
mod flash;
#[cfg(target_os = "none")]
mod outputs;
#[cfg(target_os = "none")]
mod pulses;
#[cfg(target_os = "none")]
mod register;
#[cfg(target_os = "none")]
mod stop;
#[cfg(target_os = "none")]
mod usart;
#[cfg(target_os = "none")]
mod vectors;
#[cfg(target_os = "none")]
mod watchdog;

#[cfg(target_os = "none")]
mod image {
    use super::{clock, common, flash, outputs, pulses, stop, usart, vectors, watchdog};
    use cortex_m_rt::entry;
    use giotto_firmware::server::Board;
    use giotto_shared::wire::{ClockSource, PositionState, ResetCause};

    fn board(clock: ClockSource, reset: ResetCause) -> Board {
        Board {
            name: "stm32f405",
            build: env!("GIOTTO_BUILD"),
            tick_hz: common::TICK_HZ,
            clock,
            reset,
            machine: flash::machine(),
            step: [pulses::STEP; 3],
            bears: pulses::bears,
        }
    }

    #[entry]
    fn main() -> ! {
        let reset = clock::reset_cause();
        let clock = clock::start();
        let source = if clock.fell_back {
            ClockSource::Internal
        } else {
            ClockSource::Crystal
        };
        stop::prepare();
        let board = board(source, reset);
        let (flash, limits) = common::limits(&board, flash::Flash::new(), flash::LAYOUT);
        let board = Board {
            tick_hz: limits.tick_hz,
            ..board
        };
        let pulses = pulses::Pulses::new(clock.core_hz, &limits, common::kept_place_nm());
        outputs::prepare(pulses);
        let started = cortex_m::Peripherals::take().and_then(|mut core| {
            core.DCB.enable_trace();
            core.DWT.enable_cycle_counter();
            let link = usart::Usart::link(&clock)?;
            common::interrupt::enable::<{ vectors::LINK }>(&mut core.NVIC);
            let desk = common::start(
                &mut core.SYST,
                &mut core.SCB,
                (clock.core_hz, board.tick_hz),
                PositionState::Unknown,
            )?;
            Some((link, desk, common::buffers()?, core.SYST))
        });
        let Some((link, desk, buffers, syst)) = started else {
            cortex_m::asm::udf()
        };
        if clock.fell_back {
            defmt::warn!("clock: no crystal, running on the internal oscillator");
        }
        watchdog::start();
        let ports = common::Ports {
            link,
            stream: Some(usart::Usart::stream(&clock)),
            log: usart::Usart::log(&clock),
            feed: watchdog::feed,
            // The emulator has no watchdog of this part.
            #[cfg(feature = "stepped")]
            still: || {},
            lost: common::port::lost,
        };
        common::background(board, flash, flash::LAYOUT, (desk, buffers, syst), ports)
    }
}
