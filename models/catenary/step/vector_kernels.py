"""Eight numbers at once, for numba: a type of its own, because the compiler finds them by itself in simple loops only.

On a processor that takes fewer at a time the compiler splits them.
"""

from llvmlite import ir  # type: ignore[import-untyped]
from numba import njit, types
from numba.extending import intrinsic, models, register_model
from numba.np.arrayobj import populate_array

#: Numbers taken at once.
LANES = 8
#: Sums may be reordered and fused, not more: infinities and NaN stay what they are.
SUMS = ("reassoc", "contract", "nsz")
#: What is called from Python; its machine code is kept.
compiled = njit(cache=True, fastmath=set(SUMS), error_model="numpy")
#: What is called by other kernels alone: nothing is made for Python, which takes the compiler most of its time.
part = njit(  # type: ignore[call-overload]
    fastmath=set(SUMS), error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True
)


class Vector(types.Type):
    """Numba's type of eight numbers."""

    def __init__(self):
        super().__init__(name="eight numbers")


@register_model(Vector)
class _VectorModel(models.PrimitiveModel):
    def __init__(self, manager, numba_type):
        super().__init__(manager, numba_type, ir.VectorType(ir.DoubleType(), LANES))


vector = Vector()


def _place(context, builder, signature, arguments):
    """Return the address of ``array[index]``."""
    array = context.make_array(signature.args[0])(context, builder, arguments[0])
    return builder.gep(array.data, [arguments[1]])


@intrinsic
def get(typing, array, index):
    """Return ``array[index : index + 8]`` of a contiguous array."""

    def generate(context, builder, signature, arguments):
        address = _place(context, builder, signature, arguments)
        at = builder.bitcast(address, ir.VectorType(ir.DoubleType(), LANES).as_pointer())
        return builder.load(at, align=8)

    return vector(array, index), generate


@intrinsic
def put(typing, array, index, value):
    """Write ``array[index : index + 8]``."""

    def generate(context, builder, signature, arguments):
        address = _place(context, builder, signature, arguments)
        at = builder.bitcast(address, ir.VectorType(ir.DoubleType(), LANES).as_pointer())
        builder.store(arguments[2], at, align=8)
        return context.get_dummy_value()

    return types.void(array, index, value), generate


@intrinsic
def plus_product(typing, start, one, other):
    """Return ``start + one * other``."""

    def generate(context, builder, signature, arguments):
        return builder.fadd(arguments[0], builder.fmul(arguments[1], arguments[2], SUMS), SUMS)

    return vector(start, one, other), generate


@intrinsic
def minus_product(typing, start, one, other):
    """Return ``start - one * other``."""

    def generate(context, builder, signature, arguments):
        return builder.fsub(arguments[0], builder.fmul(arguments[1], arguments[2], SUMS), SUMS)

    return vector(start, one, other), generate


@intrinsic
def product(typing, one, other):
    """Return ``one * other``."""

    def generate(context, builder, signature, arguments):
        return builder.fmul(arguments[0], arguments[1], SUMS)

    return vector(one, other), generate


@intrinsic
def nothing(typing):
    """Return eight zeros."""

    def generate(context, builder, signature, arguments):
        return ir.Constant(ir.VectorType(ir.DoubleType(), LANES), None)

    return vector(), generate


@intrinsic
def spread(typing, number):
    """Return a number eight times."""

    def generate(context, builder, signature, arguments):
        whole = ir.VectorType(ir.DoubleType(), LANES)
        first = builder.insert_element(ir.Constant(whole, ir.Undefined), arguments[0], ir.Constant(ir.IntType(32), 0))
        places = ir.Constant(ir.VectorType(ir.IntType(32), LANES), None)
        return builder.shuffle_vector(first, ir.Constant(whole, ir.Undefined), places)

    return vector(types.float64), generate


@intrinsic
def total(typing, value):
    """Return the sum of the eight numbers."""

    def generate(context, builder, signature, arguments):
        whole = ir.VectorType(ir.DoubleType(), LANES)
        kind = ir.FunctionType(ir.DoubleType(), [ir.DoubleType(), whole])
        reduce = builder.module.globals.get("llvm.vector.reduce.fadd.v8f64") or ir.Function(
            builder.module, kind, "llvm.vector.reduce.fadd.v8f64"
        )
        return builder.call(reduce, [ir.Constant(ir.DoubleType(), -0.0), arguments[0]], fastmath=SUMS)

    return types.float64(value), generate


#: What arrays of a book hold: numbers, whole numbers, such from 0, and such in 32 bits, where less to read counts.
_ELEMENTS = {"f": types.float64, "i": types.int64, "u": types.uint64, "w": types.uint32}


def reader(kind, elements):
    """Return a function that gives arrays of a book as a named tuple, from the k-th on.

    Parameters
    ----------
    kind : type
        Named tuple.
    elements : str
        A letter of `_ELEMENTS` for each; the book, see `models.catenary.step.array_book`, does not say.
    """
    arrays = [types.Array(_ELEMENTS[letter], 1, "C") for letter in elements]
    result = types.NamedTuple(arrays, kind)

    @intrinsic
    def read(typing, book, k):
        def generate(context, builder, signature, arguments):
            known = context.make_array(signature.args[0])(context, builder, arguments[0])
            here = builder.gep(known.data, [builder.mul(arguments[1], ir.Constant(arguments[1].type, 2))])
            values = []
            for i, of in enumerate(arrays):
                address, size = (
                    builder.load(builder.gep(here, [ir.Constant(ir.IntType(64), 2 * i + j)])) for j in (0, 1)
                )
                array = context.make_array(of)(context, builder)
                width = ir.Constant(ir.IntType(64), of.dtype.bitwidth // 8)
                data = builder.inttoptr(address, array.data.type)
                populate_array(array, data=data, shape=[size], strides=[width], itemsize=width, meminfo=None)
                values.append(array._getvalue())
            return context.make_tuple(builder, result, values)

        return result(book, types.int64), generate

    return read
