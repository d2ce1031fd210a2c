//! The terminal: keys in, pictures out.
use super::controller_state::{Leaving, View};
use super::watch::{Wish, watch};
use super::{Args, Failure, Output, draw};
use giotto_link::Controller;
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event as Key, KeyCode, KeyEventKind, KeyModifiers};
use std::io;
use std::sync::mpsc::{Sender, channel};
use std::time::Duration;

/// From one picture to the next.
const PICTURE: Duration = Duration::from_millis(50);

/// Watches until `q`; the terminal is left as it was found, also after a panic.
pub(super) fn run(args: Args, controller: Controller) -> Result<(), Failure> {
    let (wishes, hear) = channel();
    let (tell, events) = channel();
    let circle = args.circle();
    let mut view = View::new(controller.port());
    let interval = Duration::from_secs_f64(args.interval);
    let silent = Output {
        json: false,
        quiet: true,
        non_interactive: true,
    };
    let count = args.count;
    let port = args.port;
    std::thread::spawn(move || watch(controller, || port.connect(silent), interval, &hear, &tell));
    if let Some(circle) = circle {
        let _ = wishes.send(Wish::Run(circle)); // nobody listens: the loop below finds out
    }
    let failed =
        |e: io::Error| Failure::usage(format_args!("the terminal cannot be drawn on: {e}"));
    let mut terminal = ratatui::try_init().map_err(failed)?;
    let mut looks = 0;
    let outcome = loop {
        for event in events.try_iter() {
            looks += u64::from(matches!(event, super::watch::Event::Status(_)));
            view.take(event);
        }
        if let Err(error) = step(&mut terminal, &view) {
            break Err(failed(error));
        }
        if view.leaving == Leaving::AtRest && !view.moves() {
            break Ok(());
        }
        match keys(&wishes, &mut view, circle.map(Wish::Run)) {
            Ok(true) => {}
            Ok(false) => break Ok(()),
            Err(error) => break Err(failed(error)),
        }
        if count.is_some_and(|count| looks >= count) {
            break Ok(());
        }
    };
    ratatui::restore();
    outcome
}

fn step(terminal: &mut DefaultTerminal, view: &View) -> io::Result<()> {
    terminal.draw(|frame| draw::draw(frame, view)).map(drop)
}

/// Takes what was typed; false: quit. A machine that moves is not left without a question.
fn keys(wishes: &Sender<Wish>, view: &mut View, again: Option<Wish>) -> io::Result<bool> {
    if !event::poll(PICTURE)? {
        return Ok(true);
    }
    let Key::Key(key) = event::read()? else {
        return Ok(true);
    };
    if key.kind != KeyEventKind::Press {
        return Ok(true);
    }
    let bypass = view.status.as_ref().is_some_and(|s| s.bypass);
    let control = key.modifiers.contains(KeyModifiers::CONTROL);
    let wish = match key.code {
        KeyCode::Char('q') | KeyCode::Esc => return Ok(stays(view)),
        KeyCode::Char('c') if control => return Ok(stays(view)),
        KeyCode::Char('s') => Some(Wish::Stop),
        // While it asks, every other key is the answer that it stays.
        _ if view.leaving == Leaving::Asked => None,
        KeyCode::Char('b') => Some(Wish::Bypass(!bypass)),
        KeyCode::Char('r') => again,
        _ => None,
    };
    view.leaving = match (view.leaving, wish) {
        (Leaving::Asked, Some(Wish::Stop)) => Leaving::AtRest,
        (Leaving::Asked, _) => Leaving::No,
        (leaving, _) => leaving,
    };
    // A watch that has ended has said why.
    wish.map_or(Ok(true), |wish| Ok(wishes.send(wish).is_ok()))
}

/// Whether who wants to quit is asked first; who wants it twice is not.
fn stays(view: &mut View) -> bool {
    let ask = view.leaving == Leaving::No && view.moves();
    if ask {
        view.leaving = Leaving::Asked;
    }
    ask
}
