//! The view as a picture of characters.
use super::controller_state::{Leaving, View, motion};
use giotto_shared::wire::{Probation, SlotState, Status};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::Line;
use ratatui::widgets::canvas::{Canvas, Points};
use ratatui::widgets::{Block, Paragraph, Wrap};

/// Columns of the panel beside the picture.
const PANEL: u16 = 44;
/// A character is about twice as high as wide.
const CELL_ASPECT: f64 = 2.0;

/// Draws the view.
pub(super) fn draw(frame: &mut Frame<'_>, view: &View) {
    let [head, body, foot] = Layout::vertical([
        Constraint::Length(1),
        Constraint::Min(3),
        Constraint::Length(1),
    ])
    .areas(frame.area());
    frame.render_widget(Paragraph::new(headline(view)), head);
    if body.width >= PANEL + 20 {
        let [picture, panel] =
            Layout::horizontal([Constraint::Min(20), Constraint::Length(PANEL)]).areas(body);
        trace(frame, view, picture);
        state(frame, view, panel);
    } else {
        state(frame, view, body);
    }
    frame.render_widget(
        Paragraph::new(match view.leaving {
            Leaving::No => "q quit   s stop   b bypass on/off   r run again",
            Leaving::Asked => {
                "The machine moves: s stops it first, q leaves it (its run ends unwatched), any other key stays."
            }
            Leaving::AtRest => "Stopping; this ends when the machine is at rest.   q leaves now",
        }),
        foot,
    );
}

fn headline(view: &View) -> Line<'static> {
    match (&view.lost, &view.identity) {
        (Some(why), _) => {
            let text = format!("LOST  {why}; trying to open it again");
            Line::styled(
                text,
                Style::new().fg(Color::Red).add_modifier(Modifier::BOLD),
            )
        }
        (None, Some(who)) => Line::raw(format!("{} {} at {}", who.board, who.build, view.port)),
        (None, None) => Line::raw(format!("asking {}", view.port)),
    }
}

fn trace(frame: &mut Frame<'_>, view: &View, area: Rect) {
    let trace = view.trace();
    let title = if trace.programmed.is_empty() {
        " no set-points yet ".to_owned()
    } else {
        format!(
            " · programmed  • corrected, ×{}: up to {:.1} µm ",
            trace.magnification, trace.largest_um
        )
    };
    let (columns, rows) = (
        f64::from(area.width.saturating_sub(2).max(1)),
        f64::from(area.height.saturating_sub(2).max(1)),
    );
    let wide = columns / (CELL_ASPECT * rows);
    // The shorter side holds the whole trace.
    let reach = if wide < 1.0 {
        [trace.reach, trace.reach / wide]
    } else {
        [trace.reach * wide, trace.reach]
    };
    let bounds = [0, 1].map(|i| [trace.centre[i] - reach[i], trace.centre[i] + reach[i]]);
    let canvas = Canvas::default()
        .block(Block::bordered().title(title))
        .x_bounds(bounds[0])
        .y_bounds(bounds[1])
        .paint(|picture| {
            picture.draw(&Points {
                coords: &trace.programmed,
                color: Color::DarkGray,
            });
            picture.layer();
            picture.draw(&Points {
                coords: &trace.corrected,
                color: Color::Green,
            });
            if let (Some((x, y)), false) = (trace.corrected.last(), trace.corrected.is_empty()) {
                picture.print(*x, *y, "●");
            }
        });
    frame.render_widget(canvas, area);
}

fn state(frame: &mut Frame<'_>, view: &View, area: Rect) {
    let mut lines = view
        .status
        .as_ref()
        .map_or_else(|| vec![Line::raw("no answer yet")], |s| words(s));
    if view.losses > 0 {
        lines.push(Line::raw(format!("line lost    {}×", view.losses)));
    }
    if let Some(why) = &view.refused {
        lines.push(Line::styled(
            format!("refused      {why}"),
            Style::new().fg(Color::Yellow),
        ));
    }
    let old = if view.lost.is_some() {
        " state before the loss "
    } else {
        " state "
    };
    let panel = Paragraph::new(lines)
        .wrap(Wrap { trim: false })
        .block(Block::bordered().title(old));
    frame.render_widget(panel, area);
}

fn words(status: &Status) -> Vec<Line<'static>> {
    let counts = &status.counters;
    let place = |nm: [i32; 3]| {
        let [x, y, z] = nm.map(|v| f64::from(v) * 1e-6);
        format!("{x:.4} {y:.4} {z:.4}")
    };
    let correction = match (status.active, status.bypass) {
        (None, _) => "none: no table".to_owned(),
        (Some(slot), true) => format!("bypassed, table in slot {slot}"),
        (Some(slot), false) => format!("on, table in slot {slot}"),
    };
    let probation = match status.probation {
        Probation::None => "none",
        Probation::Fresh => "not run yet",
        Probation::FirstRun => "first run",
    };
    let slot = |slot: &SlotState| match slot {
        SlotState::Empty => "empty".to_owned(),
        SlotState::Invalid => "not a whole table".to_owned(),
        SlotState::OtherFormat { version } => format!("format {version}"),
        SlotState::Table(info) => match info.generation {
            Some(generation) => format!("{:08x}, generation {generation}", info.crc),
            None => format!("{:08x}, not confirmed", info.crc),
        },
    };
    let cause = status
        .fault
        .map(|cause| format!(" ({cause:?})").to_lowercase())
        .unwrap_or_default();
    let stop = if status.stop_input {
        ", stop input active"
    } else {
        ""
    };
    let mut lines: Vec<String> = vec![
        format!("motion       {}{cause}{stop}", motion(status.motion)),
        format!("correction   {correction}"),
        format!("probation    {probation}"),
        format!("slot 0       {}", slot(&status.slots[0])),
        format!("slot 1       {}", slot(&status.slots[1])),
        format!("programmed   {} mm", place(status.raw_nm)),
        format!("corrected    {} mm", place(status.corrected_nm)),
        format!("ticks        {}", status.tick),
        format!(
            "overruns     {}; {} uncorrected",
            counts.tick_overruns, counts.uncorrected_segments
        ),
        format!(
            "clamps       offset {}, rate {}",
            counts.offset_clamps, counts.slew_clamps
        ),
        format!(
            "segments     {} done, {} waiting, {} dropped",
            counts.segments, status.queued, counts.dropped_segments
        ),
        format!(
            "stops        {}, {} runs lost their host",
            counts.stops, counts.link_losses
        ),
        format!(
            "link         {} CRC errors, {} malformed",
            counts.crc_errors, counts.malformed_frames
        ),
        format!(
            "             {} overlong, {} repeated",
            counts.overlong_frames, counts.repeated_requests
        ),
        format!(
            "lost         {} bytes, {} set-points",
            counts.lost_bytes, counts.dropped_set_points
        ),
    ];
    if status.stack_bytes > 0 {
        lines.push(format!(
            "stack        {} bytes at the deepest",
            status.stack_bytes
        ));
    }
    lines.into_iter().map(Line::raw).collect()
}

#[cfg(test)]
mod tests {
    use super::super::watch::Event;
    use super::*;
    use giotto_shared::wire::{
        ClockSource, Counters, MotionState, PositionState, ResetCause, SetPoint,
    };
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    fn status() -> Status {
        Status {
            position: PositionState::Known,
            reset: ResetCause::Power,
            clock: ClockSource::Crystal,
            worst_tick_permille: None,
            stack_left_bytes: 0,
            override_percent: 100,
            motion: MotionState::Running,
            fault: None,
            stop_input: true,
            bypass: false,
            active: Some(1),
            slots: [SlotState::Empty, SlotState::Invalid],
            probation: Probation::None,
            queued: 2,
            tick: 4321,
            stack_bytes: 0,
            idle_permille: None,
            raw_nm: [50_000_000, -1, 0],
            corrected_nm: [50_012_000, 0, 0],
            counters: Counters {
                crc_errors: 7,
                ..Counters::default()
            },
        }
    }

    fn picture(view: &View, width: u16, height: u16) -> Vec<String> {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        terminal.draw(|frame| draw(frame, view)).unwrap();
        let buffer = terminal.backend().buffer().clone();
        let row = |y| {
            (0..width)
                .map(|x| buffer[(x, y)].symbol().to_owned())
                .collect::<String>()
        };
        (0..height).map(row).collect()
    }

    fn dots(line: &str) -> usize {
        line.chars()
            .filter(|c| ('\u{2801}'..='\u{28ff}').contains(c))
            .count()
    }

    #[test]
    fn state_trace_and_counters_are_shown() {
        let mut view = View::new("/dev/ttyUSB0");
        view.take(Event::Status(Box::new(status())));
        let point = |k: usize| {
            let (sin, cos) = (k as f64 * 0.01).sin_cos();
            let at = |r: f64| [(r * cos) as i32, (r * sin) as i32, 0];
            SetPoint {
                raw_nm: at(50e6),
                corrected_nm: at(50.012e6),
            }
        };
        view.take(Event::Points((0..629).map(point).collect()));
        let lines = picture(&view, 110, 32);
        let all = lines.join("\n");
        for words in [
            "motion       running, stop input active",
            "on, table in slot 1",
            "7 CRC errors",
            "0 done, 2 waiting",
            "×500: up to 12.0 µm",
            "50.0120 0.0000",
            "q quit",
        ] {
            assert!(all.contains(words), "{words} is missing in\n{all}");
        }
        // A ring: dots above and below, none in the middle.
        let inner: Vec<usize> = lines.iter().map(|l| dots(l)).collect();
        assert!(inner[3..29].iter().all(|n| *n >= 2), "{all}");
        let middle: String = lines[16].chars().skip(25).take(15).collect();
        assert_eq!(dots(&middle), 0, "{all}");
    }

    #[test]
    fn a_loss_is_said_above_the_last_state_and_small_terminals_keep_the_words() {
        let mut view = View::new("/dev/ttyUSB0");
        view.take(Event::Status(Box::new(status())));
        view.take(Event::Down("/dev/ttyUSB0: connection lost".into()));
        let lines = picture(&view, 100, 20);
        assert!(
            lines[0].starts_with("LOST  /dev/ttyUSB0: connection lost; trying"),
            "{lines:?}"
        );
        assert!(
            lines.join("\n").contains("state before the loss")
                && lines.join("\n").contains("line lost    1×")
        );
        let small = picture(&view, 50, 20).join("\n");
        assert!(small.contains("motion       running"), "{small}");
        picture(&view, 1, 1);
    }
}
