//! The two ends of a queue between the tick and the background.

/// The end things go into.
pub trait Sender<T> {
    /// Puts one in; gives it back if there is no room.
    ///
    /// # Errors
    /// The thing itself.
    fn send(&mut self, thing: T) -> Result<(), T>;

    /// Things that wait.
    fn waiting(&self) -> usize;
}

/// The end things come out of.
pub trait Receiver<T> {
    /// The oldest one.
    fn receive(&mut self) -> Option<T>;

    /// Things that wait.
    fn waiting(&self) -> usize;
}

impl<T, const N: usize> Sender<T> for heapless_spsc::spsc::Producer<'_, T, N> {
    #[inline]
    fn send(&mut self, thing: T) -> Result<(), T> {
        self.enqueue(thing)
    }

    fn waiting(&self) -> usize {
        self.len()
    }
}

impl<T, const N: usize> Receiver<T> for heapless_spsc::spsc::Consumer<'_, T, N> {
    #[inline]
    fn receive(&mut self) -> Option<T> {
        self.dequeue()
    }

    #[inline]
    fn waiting(&self) -> usize {
        self.len()
    }
}
