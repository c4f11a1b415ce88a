"""Eight numbers at once, for numba: a type of its own, because the compiler finds them by itself in simple loops only.

On a processor that takes fewer at a time the compiler splits them.
"""

import operator

from llvmlite import ir  # type: ignore[import-untyped]
from numba import njit, types
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import intrinsic, models, register_model
from numba.np.arrayobj import populate_array

#: Numbers taken at once.
LANES = 8
_EIGHT = ir.VectorType(ir.DoubleType(), LANES)
#: Sums may be reordered and fused, not more: infinities and NaN stay what they are.
SUMS = ("reassoc", "contract", "nsz")
#: What is called from Python; its machine code is kept.
compiled = njit(cache=True, fastmath=set(SUMS), error_model="numpy")
#: What is called by other kernels alone: nothing is made for Python, which takes the compiler most of its time.
part = njit(  # type: ignore[call-overload]
    fastmath=set(SUMS), error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True
)

#: What is written into its callers: a call in the innermost loop keeps numbers from staying in registers.
inlined = njit(inline="always", fastmath=set(SUMS), error_model="numpy")


class Vector(types.Type):
    """Numba's type of eight numbers."""

    def __init__(self):
        super().__init__(name="eight numbers")


@register_model(Vector)
class _VectorModel(models.PrimitiveModel):
    def __init__(self, manager, numba_type):
        super().__init__(manager, numba_type, _EIGHT)


vector = Vector()


def _place(context, builder, signature, arguments):
    """Return the address of eight numbers from ``array[index]`` on."""
    array = context.make_array(signature.args[0])(context, builder, arguments[0])
    return builder.bitcast(builder.gep(array.data, [arguments[1]]), _EIGHT.as_pointer())


@intrinsic
def get(typing, array, index):
    """Return ``array[index : index + 8]`` of a contiguous array."""

    def generate(context, builder, signature, arguments):
        return builder.load(_place(context, builder, signature, arguments), align=8)

    return vector(array, index), generate


@intrinsic
def put(typing, array, index, value):
    """Write ``array[index : index + 8]``."""

    def generate(context, builder, signature, arguments):
        builder.store(arguments[2], _place(context, builder, signature, arguments), align=8)
        return context.get_dummy_value()

    return types.void(array, index, value), generate


def _arithmetic(operation, of_lanes):
    """Let the compiler know what an operation does to eight numbers, and to eight and one.

    Parameters
    ----------
    operation : function
        Of `operator`.
    of_lanes : str
        Of the compiler's builder.
    """

    def both(context, builder, of, arguments):
        return getattr(builder, of_lanes)(*arguments, SUMS)

    def with_one(context, builder, of, arguments):
        return getattr(builder, of_lanes)(arguments[0], _eight(builder, arguments[1]), SUMS)

    lower_builtin(operation, vector, vector)(both)
    lower_builtin(operation, vector, types.float64)(with_one)
    cases = [signature(vector, vector, other) for other in (vector, types.float64)]
    infer_global(operation)(type("Arithmetic", (ConcreteTemplate,), {"cases": cases}))


for _operation in (operator.add, operator.iadd):
    _arithmetic(_operation, "fadd")
for _operation in (operator.sub, operator.isub):
    _arithmetic(_operation, "fsub")
for _operation in (operator.mul, operator.imul):
    _arithmetic(_operation, "fmul")


def _eight(builder, number):
    """Return a number eight times."""
    first = builder.insert_element(ir.Constant(_EIGHT, ir.Undefined), number, ir.Constant(ir.IntType(32), 0))
    places = ir.Constant(ir.VectorType(ir.IntType(32), LANES), None)
    return builder.shuffle_vector(first, ir.Constant(_EIGHT, ir.Undefined), places)


@intrinsic
def nothing(typing):
    """Return eight zeros."""

    def generate(context, builder, signature, arguments):
        return ir.Constant(_EIGHT, None)

    return vector(), generate


#: How sums of eight numbers are halved, those of two vectors side by side: distance of what is added, and places.
_HALVINGS = (
    (1, (0, 8, 2, 10, 4, 12, 6, 14)),
    (2, (0, 1, 8, 9, 4, 5, 12, 13)),
    (4, (0, 1, 2, 3, 8, 9, 10, 11)),
)


def _shuffled(builder, one, other, places):
    """Return eight of the sixteen numbers of two vectors."""
    mask = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [ir.Constant(ir.IntType(32), place) for place in places])
    return builder.shuffle_vector(one, other, mask)


@intrinsic
def totals(typing, t0, t1, t2, t3, t4, t5):
    """Return the sums of six times eight numbers, and two zeros."""

    def generate(context, builder, signature, arguments):
        sums = list(arguments)
        for distance, places in _HALVINGS:
            sums += [ir.Constant(_EIGHT, None)] * (len(sums) % 2)
            pairs = zip(sums[::2], sums[1::2], strict=True)
            sums = [
                builder.fadd(*(_shuffled(builder, *pair, [k + far for k in places]) for far in (0, distance)), SUMS)
                for pair in pairs
            ]
        return sums[0]

    return vector(t0, t1, t2, t3, t4, t5), generate


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
