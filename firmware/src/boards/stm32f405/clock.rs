//! 168 MHz from the crystal, or 16 MHz from the internal oscillator if the crystal does not start (RM0090 7.2).
use super::register::Register;
use giotto_shared::wire::ResetCause;

const RCC: usize = 0x4002_3800;
const CR: Register = Register::at(RCC, 0x00);
const PLLCFGR: Register = Register::at(RCC, 0x04);
const CFGR: Register = Register::at(RCC, 0x08);
const AHB1ENR: Register = Register::at(RCC, 0x30);
const APB1ENR: Register = Register::at(RCC, 0x40);
const APB2ENR: Register = Register::at(RCC, 0x44);
const CSR: Register = Register::at(RCC, 0x74);
const FLASH_ACR: Register = Register::at(0x4002_3c00, 0x00);

const HSE_ON: u32 = 1 << 16;
const HSE_READY: u32 = 1 << 17;
const PLL_ON: u32 = 1 << 24;
const PLL_READY: u32 = 1 << 25;
const SWITCH: u32 = 0b11;
const SWITCH_PLL: u32 = 0b10;
const SWITCHED: u32 = 0b11 << 2;
const SWITCHED_PLL: u32 = 0b10 << 2;

/// The crystal.
const HSE_HZ: u32 = 12_000_000;
/// The internal oscillator.
const HSI_HZ: u32 = 16_000_000;
/// Into the loop 1 MHz, out of it 336 MHz, half of which is the core's; a seventh is USB's 48 MHz.
const PLL_M: u32 = HSE_HZ / 1_000_000;
const PLL_N: u32 = 336;
const PLL_Q: u32 = 7;
/// The core with a crystal.
pub const CORE_HZ: u32 = HSE_HZ / PLL_M * PLL_N / 2;
/// APB1 a quarter (at most 42 MHz), APB2 half (at most 84 MHz).
const DIVIDERS: u32 = 0b101 << 10 | 0b100 << 13;
/// Wait states of the flash at 168 MHz and 3.3 V (RM0090 table 10).
const WAIT_STATES: u32 = 5;
/// Prefetch, instruction and data cache.
const CACHES: u32 = 0b111 << 8;

const _: () = assert!(CORE_HZ == 168_000_000 && HSE_HZ.is_multiple_of(1_000_000));

/// Clocks as they run.
pub struct Clock {
    /// Core and SysTick.
    pub core_hz: u32,
    /// USART3.
    pub apb1_hz: u32,
    /// USART1, USART6.
    pub apb2_hz: u32,
    /// The crystal did not start.
    pub fell_back: bool,
}

/// Why the part started (RM0090 7.3.21), forgotten once it was asked for.
pub fn reset_cause() -> ResetCause {
    /// Independent and window watchdog, request, power (also brown-out), pin, in this order: a power-up sets the pin's too.
    const CAUSES: [(u32, ResetCause); 4] = [
        (0b11 << 29, ResetCause::Watchdog),
        (1 << 28, ResetCause::Request),
        (0b101 << 25, ResetCause::Power),
        (1 << 26, ResetCause::Pin),
    ];
    const FORGET: u32 = 1 << 24;
    let flags = CSR.get();
    CSR.change(0, FORGET);
    CAUSES
        .into_iter()
        .find(|(mask, _)| flags & mask != 0)
        .map_or(ResetCause::Unknown, |(_, cause)| cause)
}

/// Starts the clocks and lets them through to the ports and USARTs used.
pub fn start() -> Clock {
    let crystal = from_crystal();
    if !crystal {
        CFGR.change(SWITCH, 0);
        CR.change(HSE_ON | PLL_ON, 0);
    }
    AHB1ENR.change(0, 0b110 | 1 << 22); // GPIOB, GPIOC, DMA2
    APB1ENR.change(0, 1 << 18); // USART3
    APB2ENR.change(0, 1 | 1 << 4 | 1 << 5); // TIM1, USART1, USART6
    if crystal {
        Clock {
            core_hz: CORE_HZ,
            apb1_hz: CORE_HZ / 4,
            apb2_hz: CORE_HZ / 2,
            fell_back: false,
        }
    } else {
        // The emulator's SysTick counts 168 MHz all the same.
        let core_hz = if cfg!(feature = "stepped") {
            CORE_HZ
        } else {
            HSI_HZ
        };
        Clock {
            core_hz,
            apb1_hz: HSI_HZ,
            apb2_hz: HSI_HZ,
            fell_back: true,
        }
    }
}

/// Every step has its time; the first that does not come ends the attempt.
fn from_crystal() -> bool {
    CR.change(0, HSE_ON);
    if !CR.wait(HSE_READY, HSE_READY) {
        return false;
    }
    PLLCFGR.set(PLL_M | PLL_N << 6 | 1 << 22 | PLL_Q << 24);
    CR.change(0, PLL_ON);
    if !CR.wait(PLL_READY, PLL_READY) {
        return false;
    }
    FLASH_ACR.set(CACHES | WAIT_STATES);
    if !FLASH_ACR.wait(0xf, WAIT_STATES) {
        return false;
    }
    CFGR.change(0b111 << 10 | 0b111 << 13, DIVIDERS);
    CFGR.change(SWITCH, SWITCH_PLL);
    if !CFGR.wait(SWITCHED, SWITCHED_PLL) {
        CFGR.change(0b111 << 10 | 0b111 << 13, 0);
        return false;
    }
    true
}
