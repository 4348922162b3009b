//! A display without a screen, and a hand at its keyboard and mouse.

use std::{
    ffi::OsString,
    io::{BufRead, BufReader},
    path::Path,
    process::{Child, Command, ExitStatus, Stdio},
    sync::mpsc::{Receiver, channel},
    time::{Duration, Instant},
};
use x11rb::{
    connection::Connection,
    protocol::{
        xproto::{
            AtomEnum, ClientMessageEvent, ConfigureWindowAux, ConnectionExt, EventMask, ImageFormat, InputFocus,
            MapState,
        },
        xtest::ConnectionExt as _,
    },
    rust_connection::RustConnection,
    wrapper::ConnectionExt as _,
};

/// Anything may take this long on a busy machine without a GPU.
const LONG: Duration = Duration::from_secs(120);

pub struct Display {
    server: Child,
    pub name: String,
}

impl Display {
    pub fn new() -> Display {
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1000x800x24", "-nolisten", "tcp", "-noreset"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap_or_else(|e| {
                panic!("Xvfb, which windows are tested in, does not start ({e}): run ./setup.sh, or install xvfb")
            });
        let mut number = String::new();
        BufReader::new(server.stdout.take().expect("piped")).read_line(&mut number).expect("a display's number");
        assert!(!number.trim().is_empty(), "Xvfb ended at once: run it by hand to see why");
        Display { server, name: format!(":{}", number.trim()) }
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// Where the loader finds more drivers, also from another folder.
pub fn drivers() -> OsString {
    let files = std::env::var_os("VK_ADD_DRIVER_FILES").unwrap_or_default();
    let absolute = std::env::split_paths(&files).filter_map(|file| std::path::absolute(file).ok());
    std::env::join_paths(absolute).expect("no colon in them")
}

/// `meniscus view` in a display, and what it said.
pub struct Window {
    program: Child,
    said: Receiver<String>,
    x: RustConnection,
    root: u32,
    window: u32,
    pub lines: Vec<String>,
}

impl Window {
    /// Started in a folder, with its window there and the first file shown.
    pub fn open(display: &Display, folder: &Path, args: &[&str]) -> Window {
        let mut program = Command::new(env!("CARGO_BIN_EXE_meniscus"))
            .args(["view", "--validate"])
            .args(args)
            .current_dir(folder)
            .env("DISPLAY", &display.name)
            .env("VK_ADD_DRIVER_FILES", drivers())
            .env_remove("WAYLAND_DISPLAY")
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("meniscus starts");
        let (tell, said) = channel();
        let streams: [Box<dyn std::io::Read + Send>; 2] =
            [Box::new(program.stdout.take().expect("piped")), Box::new(program.stderr.take().expect("piped"))];
        for stream in streams {
            let tell = tell.clone();
            std::thread::spawn(move || {
                BufReader::new(stream).lines().map_while(Result::ok).try_for_each(|line| tell.send(line))
            });
        }
        let (x, screen) = x11rb::connect(Some(&display.name)).expect("an X server");
        let root = x.setup().roots[screen].root;
        let mut window = Window { program, said, x, root, window: 0, lines: Vec::new() };
        window.waits_for("showing ");
        window.window = window.find();
        let (x, at) = (&window.x, window.window);
        x.set_input_focus(InputFocus::PARENT, at, x11rb::CURRENT_TIME).expect("sent").check().expect("the focus");
        window.settle();
        window
    }

    fn find(&self) -> u32 {
        let tree = self.x.query_tree(self.root).expect("sent").reply().expect("windows");
        let named = |w: &u32| {
            let name = self.x.get_property(false, *w, AtomEnum::WM_NAME, AtomEnum::ANY, 0, 100).expect("sent");
            let there = self.x.get_window_attributes(*w).expect("sent").reply();
            name.reply().is_ok_and(|n| n.value == b"meniscus") && there.is_ok_and(|a| a.map_state == MapState::VIEWABLE)
        };
        tree.children.into_iter().find(named).expect("a window called meniscus")
    }

    /// Waits until it says a line that begins so.
    pub fn waits_for(&mut self, start: &str) -> String {
        let end = Instant::now() + LONG;
        loop {
            match self.said.recv_timeout(end.saturating_duration_since(Instant::now())) {
                Ok(line) => {
                    self.lines.push(line.clone());
                    if let Some(rest) = line.strip_prefix(start) {
                        return rest.to_owned();
                    }
                }
                Err(e) => panic!("no \"{start}\" ({e}), but {:#?}", self.lines),
            }
        }
    }

    /// Gives it time for a frame or two.
    pub fn settle(&self) {
        self.x.sync().expect("an X server");
        std::thread::sleep(Duration::from_millis(400));
    }

    fn fake(&self, kind: u8, detail: u8, [x, y]: [i16; 2]) {
        self.x.xtest_fake_input(kind, detail, 0, self.root, x, y, 0).expect("sent").check().expect("an event");
    }

    fn code(&self, symbol: u32) -> u8 {
        let (least, most) = (self.x.setup().min_keycode, self.x.setup().max_keycode);
        let map = self.x.get_keyboard_mapping(least, most - least + 1).expect("sent").reply().expect("a keyboard");
        let mut keys = map.keysyms.chunks(map.keysyms_per_keycode.into());
        least + keys.position(|symbols| symbols.contains(&symbol)).unwrap_or_else(|| panic!("no key {symbol:#x}")) as u8
    }

    pub fn down(&self, symbol: u32) {
        self.fake(KEY_PRESS, self.code(symbol), [0; 2]);
    }

    pub fn up(&self, symbol: u32) {
        self.fake(KEY_RELEASE, self.code(symbol), [0; 2]);
    }

    pub fn key(&self, symbol: u32) {
        self.down(symbol);
        self.up(symbol);
    }

    pub fn types(&self, text: &str) {
        text.bytes().for_each(|c| self.key(c.into()));
    }

    /// Where a place in the window is on the screen.
    fn place(&self, [x, y]: [i16; 2]) -> [i16; 2] {
        let at = self.x.translate_coordinates(self.window, self.root, x, y).expect("sent").reply().expect("a place");
        [at.dst_x, at.dst_y]
    }

    /// Presses a button at a place, and lets it go at another.
    pub fn drag(&self, button: u8, from: [i16; 2], to: [i16; 2]) {
        self.fake(MOTION, 0, self.place(from));
        self.fake(BUTTON_PRESS, button, [0; 2]);
        for i in 1..=4 {
            let between = [0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * i / 4);
            self.fake(MOTION, 0, self.place(between));
        }
        self.fake(BUTTON_RELEASE, button, [0; 2]);
        self.x.sync().expect("an X server");
    }

    /// Turns the wheel by one, at a place.
    pub fn wheel(&self, up: bool, at: [i16; 2]) {
        self.drag(if up { 4 } else { 5 }, at, at);
    }

    pub fn resize(&self, [width, height]: [u32; 2]) {
        let to = ConfigureWindowAux::new().width(width).height(height);
        self.x.configure_window(self.window, &to).expect("sent").check().expect("another size");
    }

    pub fn minimise(&self) {
        self.x.unmap_window(self.window).expect("sent").check().expect("unmapped");
    }

    pub fn restore(&self) {
        self.x.map_window(self.window).expect("sent").check().expect("mapped");
        self.settle();
        let focus = self.x.set_input_focus(InputFocus::PARENT, self.window, x11rb::CURRENT_TIME);
        focus.expect("sent").check().expect("the focus");
    }

    /// What a window manager does when its cross is clicked.
    pub fn close(&self) {
        let atom = |name: &[u8]| self.x.intern_atom(false, name).expect("sent").reply().expect("an atom").atom;
        let data = [atom(b"WM_DELETE_WINDOW"), x11rb::CURRENT_TIME, 0, 0, 0];
        let message = ClientMessageEvent::new(32, self.window, atom(b"WM_PROTOCOLS"), data);
        self.x.send_event(false, self.window, EventMask::NO_EVENT, message).expect("sent").check().expect("sent");
    }

    /// Its pixels as they are on the screen, and their width and height.
    pub fn pixels(&self) -> ([u32; 2], Vec<[u8; 3]>) {
        let size = self.x.get_geometry(self.window).expect("sent").reply().expect("a size");
        let (w, h) = (size.width, size.height);
        let image = self.x.get_image(ImageFormat::Z_PIXMAP, self.window, 0, 0, w, h, u32::MAX);
        let image = image.expect("sent").reply().expect("pixels");
        ([w.into(), h.into()], image.data.chunks_exact(4).map(|p| [p[2], p[1], p[0]]).collect())
    }

    /// Waits until it ends, and expects that nothing went wrong and validation had nothing to say.
    pub fn ends(mut self) {
        let end = Instant::now() + LONG;
        let status: ExitStatus = loop {
            match self.program.try_wait().expect("a process") {
                Some(status) => break status,
                None if Instant::now() > end => panic!("it does not end; it said {:#?}", self.lines),
                None => std::thread::sleep(Duration::from_millis(20)),
            }
        };
        self.lines.extend(self.said.iter());
        assert_eq!(status.code(), Some(0), "{:#?}", self.lines);
        assert!(!self.lines.iter().any(|l| l.contains("validation:") || l.contains("panicked")), "{:#?}", self.lines);
    }
}

impl Drop for Window {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

const KEY_PRESS: u8 = 2;
const KEY_RELEASE: u8 = 3;
const BUTTON_PRESS: u8 = 4;
const BUTTON_RELEASE: u8 = 5;
const MOTION: u8 = 6;

/// Symbols of keys that write nothing.
pub mod keys {
    pub const TAB: u32 = 0xff09;
    pub const ENTER: u32 = 0xff0d;
    pub const ESCAPE: u32 = 0xff1b;
    pub const RIGHT: u32 = 0xff53;
    pub const DOWN: u32 = 0xff54;
    pub const END: u32 = 0xff57;
    pub const F2: u32 = 0xffbf;
    pub const F3: u32 = 0xffc0;
}
