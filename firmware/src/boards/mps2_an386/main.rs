//! Image for ARM's MPS2 with the AN386 FPGA image (Cortex-M4F, 25 MHz) as QEMU emulates it: `-machine mps2-an386`.
//!
//! | port | use |
//! |---|---|
//! | UART0 | the host's link |
//! | UART1 | set-points while a run is in progress, in the frames of the link; in: the stop switch, `!` pressed, `.` released |
//! | UART2 | the log, in defmt's encoding (`defmt-print -e IMAGE`) |
//!
//! Tables are kept in a window of code memory that behaves like NOR flash; it survives a warm reset, not the
//! end of the emulator. Once the host grants ticks, time passes as it does (`common::steps`). Never run on the FPGA
//! board itself.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("an image for a board: build it for thumbv7em-none-eabihf");
}

#[cfg(target_os = "none")]
#[path = "../common/mod.rs"]
mod common;
#[cfg(target_os = "none")]
mod flash;
#[cfg(target_os = "none")]
mod outputs;
#[cfg(target_os = "none")]
mod stop;
#[cfg(target_os = "none")]
mod uart;
#[cfg(target_os = "none")]
mod vectors;
#[cfg(target_os = "none")]
mod watchdog;

#[cfg(target_os = "none")]
mod image {
    use super::{common, flash, uart, vectors, watchdog};
    use cortex_m_rt::entry;
    use embedded_io::{Read, Write};
    use giotto_firmware::server::Board;
    use giotto_firmware::server::link::write_whole;
    use giotto_shared::wire::{ClockSource, ConfigField, MachineConfig, PositionState, ResetCause};

    /// Clock of core and peripherals (DAI0386 2.5).
    const CLOCK_HZ: u32 = 25_000_000;
    const BOARD: Board = Board {
        name: "mps2-an386",
        build: env!("GIOTTO_BUILD"),
        tick_hz: common::TICK_HZ,
        clock: ClockSource::Crystal,
        // The emulator does not say.
        reset: ResetCause::Unknown,
        machine: [0; 12],
        step: [[1, 1]; 3],
        bears,
    };

    /// Ticks that leave the background half of its time (`giotto-hil rate`).
    fn bears(limits: &MachineConfig) -> Result<(), ConfigField> {
        if limits.tick_hz <= 8000 {
            Ok(())
        } else {
            Err(ConfigField::Rate)
        }
    }

    /// Sends back what comes, byte for byte: what the line itself carries (feature `echo`, for `giotto-hil link`).
    fn echo(mut link: impl Read + Write) -> ! {
        let mut bytes = [0; 64];
        loop {
            let sent = link
                .read(&mut bytes)
                .map(|count| write_whole(&mut link, bytes.get(..count).unwrap_or(&[])));
            if !matches!(sent, Ok(Ok(()))) {
                cortex_m::asm::udf();
            }
        }
    }

    #[entry]
    fn main() -> ! {
        let board = Board {
            machine: flash::machine(),
            ..BOARD
        };
        let (flash, limits) = common::limits(&board, flash::Window::new(), flash::LAYOUT);
        let board = Board {
            tick_hz: limits.tick_hz,
            ..board
        };
        let started = cortex_m::Peripherals::take().and_then(|mut core| {
            let link = uart::Uart::link()?;
            common::interrupt::enable::<{ vectors::LINK }>(&mut core.NVIC);
            let desk = common::start(
                &mut core.SYST,
                &mut core.SCB,
                (CLOCK_HZ, board.tick_hz),
                PositionState::Known,
            )?;
            Some((link, desk, common::buffers()?, core.SYST))
        });
        let Some((link, desk, buffers, syst)) = started else {
            cortex_m::asm::udf()
        };
        if cfg!(feature = "echo") {
            echo(link)
        }
        watchdog::start(CLOCK_HZ);
        let ports = common::Ports {
            link,
            // At eight times the ticks the line could not carry a set-point each.
            stream: (!cfg!(feature = "fast")).then(uart::Uart::stream),
            log: uart::Uart::log(),
            feed: watchdog::feed,
            still: watchdog::stop,
            lost: common::port::lost,
        };
        common::background(board, flash, flash::LAYOUT, (desk, buffers, syst), ports)
    }
}
