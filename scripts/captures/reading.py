"""Arrays of MATLAB (5 and 7.3), HDF5 and NumPy files, with their axes in the order of the program that wrote them: HDF5 is taken to
be MATLAB's."""

import warnings
import zipfile

import h5py
import numpy as np
import scipy.io
import scipy.sparse
from isochron.captures import CaptureError


class Arrays:
    """The arrays of one file by name. Those of HDF5 are read in parts: whole they may be larger than the memory."""

    def __init__(self, path, members):
        self.path, self.members = path, members

    def __contains__(self, name):
        return name in self.members

    def shape(self, name):
        """The shape in the order of axes of MATLAB or NumPy."""
        member = self.members[name]
        return member.shape[::-1] if isinstance(member, h5py.Dataset) else member.shape

    def read(self, name, slices=()):
        """The array, or the part that one slice per axis selects."""
        member = self.members[name]
        if not slices:
            slices = (slice(None),) * member.ndim
        if scipy.sparse.issparse(member):
            member = member.toarray()
        # MATLAB stores the first axis fastest, HDF5 names the fastest last.
        part = member[slices[::-1]].T if isinstance(member, h5py.Dataset) else member[slices]
        if part.dtype.kind not in "biuf":
            raise CaptureError(f"{self.path}: {name} holds no numbers")
        return part

    def number(self, name):
        value = self.read(name)
        if value.size != 1 or not np.isfinite(value).all():
            raise CaptureError(f"{self.path}: {name} is not one number")
        return float(value.reshape(-1)[0])

    def only_counts(self):
        """The name of the one array that can hold counts: of two or three axes, and numbers."""
        names = [n for n, m in self.members.items() if m.ndim in (2, 3) and m.size > 1 and m.dtype.kind in "biuf"]
        deepest = max((self.members[n].ndim for n in names), default=0)
        names = [n for n in names if self.members[n].ndim == deepest]
        if len(names) != 1:
            found = ", ".join(sorted(names)) or "none"
            raise CaptureError(f"{self.path}: which array holds the counts? (--variable NAME; there are: {found})")
        return names[0]


def _sparse(group):
    """MATLAB 7.3 keeps the columns of a sparse matrix: where each begins, and the rows and values of what is not zero."""
    starts = group["jc"][()]
    shape = int(group.attrs["MATLAB_sparse"]), len(starts) - 1
    if "data" not in group:
        return scipy.sparse.csc_matrix(shape)
    return scipy.sparse.csc_matrix((group["data"][()], group["ir"][()], starts), shape)


def _matlab(path):
    if h5py.is_hdf5(path):  # version 7.3, with or without the header that MATLAB writes before it
        file = h5py.File(path, "r")
        members = {name: member for name, member in file.items() if isinstance(member, h5py.Dataset) and member.shape is not None}
        members |= {name: _sparse(member) for name, member in file.items() if "MATLAB_sparse" in member.attrs}
    else:
        members = scipy.io.loadmat(path)
    return {n: m for n, m in members.items() if not n.startswith("__")}


def open_arrays(path):
    """The arrays of a .mat, .hdf5, .h5, .npy or .npz file."""
    readers = {
        **dict.fromkeys((".mat", ".hdf5", ".h5"), _matlab),
        ".npy": lambda p: {"array": np.load(p, mmap_mode="r")},
        ".npz": lambda p: dict(np.load(p)),
    }
    if path.suffix not in readers:
        raise CaptureError(f"{path}: not a file of MATLAB, HDF5 or NumPy (.mat, .hdf5, .h5, .npy, .npz)")
    try:
        path.open("rb").close()  # the readers do not all say why it fails
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return Arrays(path, readers[path.suffix](path))
    except (OSError, LookupError) as error:  # LookupError: too short or strange for SciPy
        reason = getattr(error, "strerror", None) or "damaged, or of another format"
        raise CaptureError(f"{path}: cannot be read: {reason}") from None
    except (ValueError, TypeError, EOFError, MemoryError, NotImplementedError, zipfile.BadZipFile,
            scipy.io.matlab.MatReadError) as error:
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise CaptureError(f"{path}: cannot be read: {reason}") from None
