"""Named tuples of arrays passed to kernels by reference, which more than halves the time to compile them.

By value, numba writes out every array of a `Model`, a `State` and a `Work` in every call, seven to nine numbers each,
more than eight hundred together. By reference, a kernel takes one pointer to a block of memory, which the wrapper of
the call from Python fills; reading a field is one load at a fixed offset. No kernel writes to a block, and LLVM gets
this as an attribute: the addresses of arrays then stay in registers across a loop, as they do by value.
"""

import hashlib
from functools import cache
from itertools import accumulate
from typing import get_args

from llvmlite import ir
from numba import extending
from numba.core import cgutils, types
from numba.core.imputils import impl_ret_borrowed
from numba.core.typing.templates import AttributeTemplate
from numba.extending import typeof_impl

WORD = 8  # bytes; the offset of every field is a multiple


class Block(types.Type):
    """Type of a named tuple of arrays that is passed by reference; ``members`` are the types of its fields."""

    def __init__(self, kind, members):
        self.kind, self.members = kind, tuple(members)
        content = f"{kind.__module__}.{kind.__qualname__}({', '.join(map(str, self.members))})"
        # every function that takes a block has this name in its own, where the members would fill pages
        super().__init__(f"{kind.__name__}_{hashlib.sha256(content.encode()).hexdigest()[:16]}")


extending.register_model(Block)(extending.models.OpaqueModel)  # the address of its first byte


@cache
def _offsets(context, block):
    """Return the offsets of all fields of a block and of its end, bytes."""
    sizes = []
    for member in block.members:
        if isinstance(member, Block):
            sizes.append(_offsets(context, member)[-1])
        else:
            size = 0 if member is types.none else context.get_abi_sizeof(context.get_value_type(member))
            sizes.append(-(-size // WORD) * WORD)
    return list(accumulate(sizes, initial=0))


def _field(context, builder, block, address, index):
    """Return the pointer to a field of a block."""
    address = cgutils.pointer_add(builder, address, _offsets(context, block)[index])
    member = block.members[index]
    if isinstance(member, Block):
        return address
    return builder.bitcast(address, context.get_value_type(member).as_pointer())


@extending.infer_getattr
class _BlockAttributes(AttributeTemplate):
    key = Block

    def generic_resolve(self, block, name):
        fields = block.kind._fields
        return block.members[fields.index(name)] if name in fields else None


@extending.lower_getattr_generic(Block)
def _load_field(context, builder, block, address, name):
    index = block.kind._fields.index(name)
    member = block.members[index]
    if member is types.none:
        return context.get_dummy_value()
    for argument in builder.function.args:
        if argument.type == cgutils.voidptr_t:
            argument.add_attribute("noalias")  # nothing is written through any other pointer to it
    field = _field(context, builder, block, address, index)
    if isinstance(member, Block):
        return field
    return impl_ret_borrowed(context, builder, member, builder.load(field, align=WORD))


def _unboxing(c, member):
    """Return the function that unboxes a value of a type to an address, made once per wrapper: true on failure.

    numba's own code for an array, repeated for each of some 150, would take longer to compile than most kernels.
    """
    module, name = c.builder.module, f"unbox {member}"
    if name not in module.globals:
        field = c.context.get_value_type(member).as_pointer()
        function = ir.Function(module, ir.FunctionType(cgutils.bool_t, [c.pyapi.pyobj, field]), name)
        function.linkage = "internal"
        function.attributes.add("noinline")
        builder = ir.IRBuilder(function.append_basic_block())
        native = c.context.get_python_api(builder).to_native_value(member, function.args[0])
        builder.store(native.value, function.args[1], align=WORD)
        builder.ret(native.is_error)
    return module.globals[name]


@extending.unbox(Block)
def _unbox_block(block, value, c):
    """Copy the fields of a named tuple, and of those nested in it, into a block on the stack of the wrapper."""
    failed = cgutils.alloca_once_value(c.builder, cgutils.false_bit)
    fields = []

    def fill(block, value, address):
        for index, member in enumerate(block.members):
            if member is types.none:
                continue
            item, field = c.pyapi.tuple_getitem(value, index), _field(c.context, c.builder, block, address, index)
            if isinstance(member, Block):
                fill(member, item, field)
                continue
            error = c.builder.call(_unboxing(c, member), [item, field])
            c.builder.store(c.builder.or_(c.builder.load(failed), error), failed)
            fields.append((member, field))

    def release():
        if c.context.enable_nrt:  # a function of a user that counts references
            for member, field in fields:
                c.context.nrt.decref(c.builder, member, c.builder.load(field, align=WORD))

    words = cgutils.alloca_once(c.builder, ir.ArrayType(ir.IntType(64), _offsets(c.context, block)[-1] // WORD))
    address = c.builder.bitcast(words, cgutils.voidptr_t)
    fill(block, value, address)
    return extending.NativeValue(address, is_error=c.builder.load(failed), cleanup=release)


def register(kind) -> None:
    """Pass a class of named tuples, and those in its fields, to kernels by reference if they hold arrays."""
    for option in (kind, *get_args(kind)):
        if not hasattr(option, "_fields") or option in typeof_impl.registry:
            continue

        @typeof_impl.register(option)
        def type_of(value, context, kind=option):
            members = [typeof_impl(field, context) for field in value]
            if any(isinstance(member, (types.Array, Block)) for member in members):
                return Block(kind, members)
            return typeof_impl.dispatch(tuple)(value, context)  # only numbers, which kernels make themselves

        for field in option.__annotations__.values():
            register(field)


@extending.lower_builtin("__array__", types.Array)
def _array_of(context, builder, signature, arguments):
    """Return an array as it is: without this rule numba looks for a new one at every access."""
    return arguments[0]
