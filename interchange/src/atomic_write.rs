//! Writing a file so that nobody ever sees half of it: beside the target, synced, renamed. Output identical to
//! the file that is already there leaves that file alone, time stamp included, so that `make` can stop there. A file
//! that may only be read is replaced as any other, and may only be read again: what counts is whether its folder can be written.

use crate::error::{Error, Result};
use crate::interrupt;
use std::fs::{File, OpenOptions};
use std::io::{BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use tempfile::{NamedTempFile, TempPath};

/// Whether the target changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// A new file stands at the path.
    Written,
    /// The old file held the same bytes and was left alone.
    Unchanged,
}

/// Refuses an output that is one of the `inputs`: a slip like `-o scene.obj` must not cost the user the scene.
///
/// # Errors
/// Names the output, where another way to write the same file counts as the same.
pub fn refuse_input<'a>(output: &Path, inputs: impl IntoIterator<Item = &'a Path>) -> Result<()> {
    let Ok(place) = output.canonicalize() else { return Ok(()) };
    if inputs.into_iter().any(|input| input.canonicalize().is_ok_and(|input| input == place)) {
        return Err(Error::whole(output, "this file is an input; choose another name for the output"));
    }
    Ok(())
}

/// A file being written beside its target. Dropped without [`Partial::commit`], it goes and the target stays as it was.
#[derive(Debug)]
pub struct Partial {
    target: PathBuf,
    file: NamedTempFile,
}

impl Partial {
    /// A new file under a name of its own.
    pub fn create(target: &Path) -> Result<Self> {
        refuse_stdout(target)?;
        refuse_folder(target)?;
        let (prefix, folder) = (format!(".{}.", name_of(target)), folder_of(target));
        let make = || tempfile::Builder::new().prefix(&prefix).suffix(".partial").tempfile_in(folder);
        let file = interrupt::make(make, |file: &NamedTempFile| file.path().to_owned())
            .map_err(|e| Error::io(target, "write beside", e))?;
        Ok(Self { target: target.to_owned(), file })
    }

    /// A new file under the name of [`Partial::path_for`], where a later run finds what a killed one left. What stands
    /// there is replaced.
    pub fn create_named(target: &Path, word: &str) -> Result<Self> {
        refuse_stdout(target)?;
        refuse_folder(target)?;
        Self::named(target, word, OpenOptions::new().create(true).truncate(true))
    }

    /// The file that a killed run left under the name of [`Partial::path_for`].
    pub fn reopen(target: &Path, word: &str) -> Result<Self> {
        Self::named(target, word, &mut OpenOptions::new())
    }

    fn named(target: &Path, word: &str, options: &mut OpenOptions) -> Result<Self> {
        let io = |e| Error::io(target, "write beside", e);
        // An absolute path, so that it is found at the end whatever the working folder is by then.
        let name = Self::path_for(target, word);
        let folder = folder_of(target).canonicalize().map_err(io)?;
        let path = folder.join(name.file_name().unwrap_or_default());
        let open = || options.read(true).write(true).open(&path);
        let file = interrupt::make(open, |_| path.clone()).map_err(io)?;
        let path = TempPath::try_from_path(path).map_err(io)?;
        Ok(Self { target: target.to_owned(), file: NamedTempFile::from_parts(file, path) })
    }

    /// Where [`Partial::create_named`] writes: `.s.ff.WORD.partial` for `s.ff`.
    pub fn path_for(target: &Path, word: &str) -> PathBuf {
        target.with_file_name(format!(".{}.{word}.partial", name_of(target)))
    }

    /// What it will become.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Another handle to the file; all handles share one place in it.
    pub fn handle(&self) -> Result<File> {
        self.file.as_file().try_clone().map_err(|e| Error::io(&self.target, "write beside", e))
    }

    /// Whether the file stays where it is when it is dropped without a commit.
    pub fn keep_when_dropped(&mut self, keep: bool) {
        self.file.disable_cleanup(keep);
        if keep { interrupt::leave(self.file.path()) } else { interrupt::take_up(self.file.path()) }
    }

    /// Syncs the file and renames it to its target, unless the target holds the same bytes.
    pub fn commit(self) -> Result<Outcome> {
        let made = self.file.path().to_owned();
        let outcome = self.replace_target();
        interrupt::leave(&made);
        outcome
    }

    fn replace_target(mut self) -> Result<Outcome> {
        let path = self.target.clone();
        let io = |action: &'static str| {
            let path = &path;
            move |e| Error::io(path, action, e)
        };
        self.file.disable_cleanup(false);
        if same_bytes(self.file.as_file_mut(), &path).map_err(io("compare with"))? {
            return Ok(Outcome::Unchanged);
        }
        set_normal_permissions(self.file.as_file(), &path).map_err(io("set permissions of"))?;
        self.file.as_file().sync_all().map_err(io("sync"))?;
        self.file.persist(&path).map_err(|e| Error::io(&path, "rename to", e.error))?;
        sync_folder(folder_of(&path));
        Ok(Outcome::Written)
    }
}

fn refuse_folder(path: &Path) -> Result<()> {
    match path.is_dir() {
        true => Err(Error::io(path, "write", std::io::ErrorKind::IsADirectory.into())),
        false => Ok(()),
    }
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn name_of(path: &Path) -> String {
    path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
}

/// The name that stands for standard output; a file of this name is `./-`.
pub const STDOUT: &str = "-";

/// Whether an output is standard output.
pub fn is_stdout(path: &Path) -> bool {
    path == Path::new(STDOUT)
}

/// Refuses [`STDOUT`] as the name of what must be a file, before anything is computed for it.
///
/// # Errors
/// It is standard output.
pub fn refuse_stdout(path: &Path) -> Result<()> {
    let message = "expected the name of a file: standard output takes tables and geometry only; for a file of this name say ./-";
    if is_stdout(path) { Err(Error::whole(path, message)) } else { Ok(()) }
}

/// Writes what `fill` produces to `path`, or to standard output where that is [`STDOUT`]. On any error the old file is
/// untouched.
pub fn write(path: &Path, fill: impl FnOnce(&mut dyn WriteSeek) -> std::io::Result<()>) -> Result<Outcome> {
    let io = |e| Error::io(path, "write", e);
    if is_stdout(path) {
        let mut all = std::io::Cursor::new(Vec::new());
        fill(&mut all).map_err(io)?;
        crate::tool::print_bytes(all.get_ref()).map_err(io)?;
        return Ok(Outcome::Written);
    }
    let partial = Partial::create(path)?;
    let mut buffered = BufWriter::with_capacity(1 << 20, partial.handle()?);
    fill(&mut buffered).map_err(io)?;
    buffered.flush().map_err(io)?;
    drop(buffered);
    partial.commit()
}

/// A sink that can go back to fill in what it only knows at the end.
pub trait WriteSeek: Write + Seek {}
impl<T: Write + Seek> WriteSeek for T {}

/// Writes `bytes` to `path`, as [`write()`] does.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<Outcome> {
    write(path, |out| out.write_all(bytes))
}

/// Whether `path` exists and holds exactly the bytes of `new`.
fn same_bytes(new: &mut File, path: &Path) -> std::io::Result<bool> {
    let old = match File::open(path) {
        Ok(old) => old,
        Err(_) => return Ok(false),
    };
    if old.metadata()?.len() != new.metadata()?.len() {
        return Ok(false);
    }
    new.seek(SeekFrom::Start(0))?;
    let (mut old, mut new) = (BufReader::with_capacity(1 << 20, old), BufReader::with_capacity(1 << 20, new));
    let (mut old_chunk, mut new_chunk) = (vec![0; 1 << 16], vec![0; 1 << 16]);
    loop {
        let read = new.read(&mut new_chunk)?;
        if read == 0 {
            return Ok(true);
        }
        if old.read_exact(&mut old_chunk[..read]).is_err() || old_chunk[..read] != new_chunk[..read] {
            return Ok(false);
        }
    }
}

/// Gives the new file the permissions of the one it replaces, or those any new file would get (a temporary file
/// is readable by its owner only).
#[cfg(unix)]
fn set_normal_permissions(file: &File, path: &Path) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    let mode = match std::fs::metadata(path) {
        Ok(old) => old.permissions().mode(),
        Err(_) => new_file_mode(path)?,
    };
    file.set_permissions(std::fs::Permissions::from_mode(mode & 0o777))
}

/// The mode that this process's umask leaves of 0666, learnt from a file made and removed beside the target
/// (asking for the umask itself means changing it, which other threads would see).
#[cfg(unix)]
fn new_file_mode(path: &Path) -> std::io::Result<u32> {
    use std::os::unix::fs::PermissionsExt;
    let sample = path.with_file_name(format!(".{}.{}.mode", name_of(path), std::process::id()));
    let file = OpenOptions::new().write(true).create(true).truncate(true).open(&sample)?;
    let mode = file.metadata()?.permissions().mode();
    std::fs::remove_file(&sample)?;
    Ok(mode)
}

#[cfg(not(unix))]
fn set_normal_permissions(_: &File, _: &Path) -> std::io::Result<()> {
    Ok(())
}

/// Makes the rename itself durable where the file system supports it; a failure here loses no data.
fn sync_folder(folder: &Path) {
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn identical_output_leaves_the_old_file_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        assert_eq!(write_bytes(&path, b"one").unwrap(), Outcome::Written);
        let before = std::fs::metadata(&path).unwrap().modified().unwrap();
        assert_eq!(write_bytes(&path, b"one").unwrap(), Outcome::Unchanged);
        assert_eq!(std::fs::metadata(&path).unwrap().modified().unwrap(), before);
        assert_eq!(write_bytes(&path, b"two").unwrap(), Outcome::Written);
        assert_eq!(std::fs::read(&path).unwrap(), b"two");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn failed_write_leaves_the_old_file_and_no_litter() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_bytes(&path, b"old").unwrap();
        let failed = write(&path, |out| {
            out.write_all(b"new")?;
            Err(std::io::ErrorKind::StorageFull.into())
        });
        assert!(failed.unwrap_err().to_string().contains("free some space"));
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn new_files_are_readable_as_the_umask_says_and_old_modes_are_kept() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (path, plain) = (folder.path().join("a.txt"), folder.path().join("plain.txt"));
        std::fs::write(&plain, "x").unwrap();
        write_bytes(&path, b"one").unwrap();
        let mode = |p: &Path| std::fs::metadata(p).unwrap().permissions().mode() & 0o777;
        assert_eq!(mode(&path), mode(&plain));
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o640)).unwrap();
        write_bytes(&path, b"two").unwrap();
        assert_eq!(mode(&path), 0o640);
    }

    /// Renaming asks for the right to write the folder, not the file.
    #[cfg(unix)]
    #[test]
    fn a_read_only_file_is_replaced_and_stays_read_only() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_bytes(&path, b"old").unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o444)).unwrap();
        assert_eq!(write_bytes(&path, b"new").unwrap(), Outcome::Written);
        assert_eq!(std::fs::read(&path).unwrap(), b"new");
        assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o444);
    }
}
