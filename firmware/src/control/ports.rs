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

    /// Looks at the oldest one where it is: a large thing taken out would pass over the stack.
    fn look<R>(&mut self, look: impl FnOnce(&T) -> R) -> Option<R>;

    /// Forgets the oldest one.
    fn discard(&mut self);

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
    fn look<R>(&mut self, look: impl FnOnce(&T) -> R) -> Option<R> {
        self.peek().map(look)
    }

    #[inline]
    fn discard(&mut self) {
        // The value is not used, so that it is not copied.
        self.dequeue();
    }

    #[inline]
    fn waiting(&self) -> usize {
        self.len()
    }
}
