//! The words between the real-time component and the program beside it, in every order of two threads and of their memory that the
//! language allows.
use giotto_corrector::marks::{self, Mark};
use loom::sync::Arc;
use loom::sync::atomic::{AtomicU32, fence};
use loom::thread;
use std::sync::atomic::Ordering::{self, Acquire, Relaxed, Release};

struct Word(AtomicU32);

impl Word {
    fn zero() -> Self {
        Self(AtomicU32::new(0))
    }
}

impl Mark for Word {
    fn load(&self, order: Ordering) -> u32 {
        self.0.load(order)
    }

    fn store(&self, value: u32, order: Ordering) {
        self.0.store(value, order);
    }

    fn fence(order: Ordering) {
        fence(order);
    }
}

/// Two marks and two words, as of a page.
struct Page([Word; 4]);

fn page() -> Arc<Page> {
    Arc::new(Page([
        Word::zero(),
        Word::zero(),
        Word::zero(),
        Word::zero(),
    ]))
}

/// Two ticks are written while they are read: never words of both.
#[test]
fn words_are_of_one_tick_or_none() {
    loom::model(|| {
        let page = page();
        let component = Arc::clone(&page);
        let ticks = thread::spawn(move || {
            let Page([begun, ended, first, second]) = &*component;
            for tick in 1..=2 {
                marks::write(begun, ended, tick, || {
                    first.store(tick, Relaxed);
                    second.store(tick, Relaxed);
                });
            }
        });
        let Page([begun, ended, first, second]) = &*page;
        let words = || [first.load(Relaxed), second.load(Relaxed)];
        if let Some((tick, words)) = marks::read(begun, ended, words) {
            assert_eq!(words, [tick; 2]);
        }
        ticks.join().unwrap();
        let last = marks::read(begun, ended, words);
        assert_eq!(last, Some((2, [2; 2])));
    });
}

/// Two offers, the second one once the first was taken: what is looked at is one of them, whole.
#[test]
fn an_offer_is_looked_at_whole() {
    loom::model(|| {
        let page = page();
        let component = Arc::clone(&page);
        let program = thread::spawn({
            let page = Arc::clone(&page);
            move || {
                let Page([offered, taken, first, second]) = &*page;
                for offer in 1..=2 {
                    if taken.load(Acquire) != offer - 1 {
                        return;
                    }
                    first.store(offer, Relaxed);
                    second.store(offer, Relaxed);
                    offered.store(offer, Release);
                }
            }
        });
        let Page([offered, taken, first, second]) = &*component;
        for _ in 0..2 {
            let mut seen = None;
            marks::take(offered, taken, || {
                seen = Some([first.load(Relaxed), second.load(Relaxed)]);
                true
            });
            if let Some([first, second]) = seen {
                assert_eq!(first, second);
                assert_eq!(first, taken.load(Relaxed));
            }
        }
        program.join().unwrap();
    });
}
