//! What a frame gives the device to do, command by command, as it went into the command buffer.

/// One command of a recorded frame that makes the device work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct WorkEntry {
    /// The pass.
    pub pass: &'static str,
    /// The shader; of a draw that of its fragments, and of a fill none.
    pub shader: &'static str,
    /// The command.
    pub command: Command,
}

/// A command and its size. Arguments of indirect ones lie in a buffer of the frame's, by its name, at an offset in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// `vkCmdFillBuffer`.
    Fill {
        /// Bytes that are filled.
        bytes: u64,
    },
    /// `vkCmdDispatch`.
    Dispatch {
        /// Work groups each way.
        groups: [u32; 3],
    },
    /// `vkCmdDispatchIndirect`.
    DispatchIndirect {
        /// Buffer of its arguments.
        buffer: &'static str,
        /// Where they begin.
        offset: u64,
    },
    /// `vkCmdDraw` of one instance.
    Draw {
        /// Vertices.
        vertices: u32,
    },
    /// `vkCmdDrawIndirect` of one draw.
    DrawIndirect {
        /// Buffer of its arguments.
        buffer: &'static str,
        /// Where they begin.
        offset: u64,
    },
}
