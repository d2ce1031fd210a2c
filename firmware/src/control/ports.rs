//! The two ends of a queue between the tick and the background.

/// The end things go into.
pub trait Sender<T> {
    /// Puts a copy of one in; `false`: there is no room.
    fn send(&mut self, thing: &T) -> bool;

    /// Things that wait.
    fn waiting(&self) -> usize;
}

/// The end things come out of.
pub trait Receiver<T> {
    /// The oldest one.
    fn receive(&mut self) -> Option<T>;

    /// Moves the oldest one, if there is one, to a place.
    fn receive_into(&mut self, place: &mut T) -> bool {
        self.receive().map(|thing| *place = thing).is_some()
    }

    /// Things that wait.
    fn waiting(&self) -> usize;
}

impl<T: Copy, const N: usize> Sender<T> for heapless_spsc::spsc::Producer<'_, T, N> {
    #[inline(never)]
    fn send(&mut self, thing: &T) -> bool {
        self.enqueue(*thing).is_ok()
    }

    fn waiting(&self) -> usize {
        self.len()
    }
}

impl<T: Copy, const N: usize> Receiver<T> for heapless_spsc::spsc::Consumer<'_, T, N> {
    #[inline]
    fn receive(&mut self) -> Option<T> {
        self.dequeue()
    }

    #[inline]
    fn receive_into(&mut self, place: &mut T) -> bool {
        // Copied where it is: a value taken out would pass over the stack.
        self.peek().map(|thing| *place = *thing).is_some_and(|()| self.dequeue().is_some())
    }

    #[inline]
    fn waiting(&self) -> usize {
        self.len()
    }
}
