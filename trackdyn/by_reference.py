"""Kernels within kernels: what spares most of the time to compile them.

By value, numba writes out every array of a `Model`, a `State` and a `Work` in every function, seven to nine numbers
each, more than eight hundred a call. A kernel therefore takes a named tuple of arrays **by reference**: one pointer to
a block of memory that the wrapper of the call from Python fills. To read a field is one load at a fixed distance.

A kernel within another is **linked only**: neither optimised on its own nor made machine code, for it runs as a part
of the kernel that Python calls and is optimised there. Its text is kept on disk, where integrators share it.

By reference uses what numba offers to extensions; for linking only a code library of numba's own is told to end
early. `trackdyn.jit` does without either where `try_out` fails with the release of numba that is installed.
"""

import hashlib
from itertools import accumulate
from operator import attrgetter
from typing import NamedTuple, get_args

import numba
import numpy as np
from llvmlite import ir
from llvmlite.binding import parse_bitcode
from numba.core import cgutils, types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, compile_result
from numba.core.imputils import impl_ret_borrowed
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import (
    NativeValue,
    intrinsic,
    lower_builtin,
    lower_getattr_generic,
    models,
    register_model,
    typeof_impl,
    unbox,
)

WORD = 8  # bytes; every field of a block begins at a multiple


class Block(types.Type):
    """A named tuple of arrays that kernels take by reference; its ``members`` are the types of its fields."""

    def __init__(self, kind, members):
        self.kind, self.members = kind, tuple(members)
        content = f"{kind.__module__}.{kind.__qualname__}({', '.join(map(str, self.members))})"
        # the name goes into that of every function, where all members would be pages
        super().__init__(f"{kind.__name__}_{hashlib.sha256(content.encode()).hexdigest()[:16]}")


@register_model(Block)
class _Pointer(models.PrimitiveModel):
    """A block is the address of its first byte."""

    def __init__(self, manager, block):
        super().__init__(manager, block, cgutils.voidptr_t)
        self.distances = None  # of the fields and of the end from the first byte, once the target's sizes are known


def _distances(context, block):
    model = context.data_model_manager[block]
    if model.distances is None:
        sizes = []
        for member in block.members:
            if isinstance(member, Block):
                sizes.append(_distances(context, member)[-1])
            else:
                size = 0 if member is types.none else context.get_abi_sizeof(context.get_value_type(member))
                sizes.append(-(-size // WORD) * WORD)
        model.distances = list(accumulate(sizes, initial=0))
    return model.distances


def _field(context, builder, block, address, index, *, member=None):
    """Address of a field of a block: of another block, or of a value."""
    address = cgutils.pointer_add(builder, address, _distances(context, block)[index])
    return address if member is None else builder.bitcast(address, context.get_value_type(member).as_pointer())


def _memory(context, builder, block):
    """Address of memory for a block on the stack of the function, and its size in bytes."""
    size = _distances(context, block)[-1]
    words = cgutils.alloca_once(builder, ir.ArrayType(ir.IntType(64), size // WORD))
    return builder.bitcast(words, cgutils.voidptr_t), size


@infer_getattr
class _Fields(AttributeTemplate):
    key = Block

    def generic_resolve(self, block, name):
        fields = block.kind._fields
        return block.members[fields.index(name)] if name in fields else None


@lower_getattr_generic(Block)
def _read(context, builder, block, address, name):
    index = block.kind._fields.index(name)
    member = block.members[index]
    if member is types.none:
        return context.get_dummy_value()
    if isinstance(member, Block):
        return _field(context, builder, block, address, index)
    value = builder.load(_field(context, builder, block, address, index, member=member), align=WORD)
    return impl_ret_borrowed(context, builder, member, value)


@unbox(Block)
def _fill(block, value, c):
    """Copy the fields of a named tuple, and of those in it, into a block on the stack of the wrapper."""
    failed = cgutils.alloca_once_value(c.builder, cgutils.false_bit)
    values = []

    def fill(block, value, address):
        for index, member in enumerate(block.members):
            if member is types.none:
                continue
            field = c.pyapi.tuple_getitem(value, index)
            if isinstance(member, Block):
                fill(member, field, _field(c.context, c.builder, block, address, index))
                continue
            native = c.unbox(member, field)
            with c.builder.if_then(native.is_error, likely=False):
                c.builder.store(cgutils.true_bit, failed)
            to = _field(c.context, c.builder, block, address, index, member=member)
            c.builder.store(native.value, to, align=WORD)
            values.append((member, native.value))

    def release():
        if c.context.enable_nrt:  # in a function of someone else that counts references
            for member, value in values:
                c.context.nrt.decref(c.builder, member, value)

    address, _ = _memory(c.context, c.builder, block)
    fill(block, value, address)
    return NativeValue(address, is_error=c.builder.load(failed), cleanup=release)


def register(kind) -> None:
    """Have a class of named tuples taken by reference, and those in its fields, where they hold arrays."""
    for part in (kind, *get_args(kind)):
        if not hasattr(part, "_fields") or part in typeof_impl.registry:
            continue

        @typeof_impl.register(part)
        def type_of(value, context, part=part):
            members = [typeof_impl(field, context) for field in value]
            if any(isinstance(member, (types.Array, Block)) for member in members):
                return Block(part, members)
            return typeof_impl.dispatch(tuple)(value, context)  # numbers alone, which kernels make themselves

        for field in part.__annotations__.values():
            register(field)


@intrinsic
def on_stack(_, block):
    """Copy a block to the stack of the function that calls this, where LLVM sees that nobody else writes it.

    Fields then stay in registers from step to step. It must stand in the kernel itself that Python calls: memory on
    the stack of a function ends with that function.
    """

    def generate(context, builder, signature, arguments):
        if not isinstance(block, Block):
            return arguments[0]
        address, size = _memory(context, builder, block)
        cgutils.raw_memcpy(builder, address, arguments[0], ir.Constant(ir.IntType(64), size), 1, align=WORD)
        return address

    return block(block), generate


@lower_builtin("__array__", types.Array)
def _array_of(context, builder, signature, arguments):
    """An array is its own: numba has no rule for that, and at every access looks whether one was added meanwhile."""
    return arguments[0]


class _Text(JITCodeLibrary):
    """Code that ends where optimisation and machine code would begin."""

    def finalize(self):
        for library in dict.fromkeys(self._linking_libraries):
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._finalized = True


# Passes of numba's for closures, array expressions, generators and the like, none of which is in a kernel. After each
# numba looks through the whole function, so that together they took as long as typing it.
UNUSED = {
    "WithLifting", "InlineClosureLikes", "RewriteDynamicRaises", "MakeFunctionToJitFunction", "FindLiterallyCalls",
    "LiteralUnroll", "LiteralPropagationSubPipelinePass", "InlineOverloads", "NopythonRewrites",
    "NoPythonSupportedFeatureValidation", "AnnotateTypes", "DumpParforDiagnostics",
}  # fmt: skip


code_of = attrgetter("library")  # numba's name for what a compilation made


class Inner(Compiler):
    """Compiler of a kernel within another."""

    def __init__(self, typing, target, library, arguments, result, flags, variables):
        library = _Text(target.codegen(), "inner")
        flags.no_compile = True
        super().__init__(typing, target, library, arguments, result, flags, variables)

    def define_pipelines(self):  # noqa: D102
        (pipeline,) = super().define_pipelines()
        pipeline.passes = [each for each in pipeline.passes if each[0].__name__ not in UNUSED]
        return [pipeline]

    def compile_extra(self, function):  # noqa: D102
        result = super().compile_extra(function)._replace(entry_point=_entry())
        result.target_context.insert_user_function(result.entry_point, result.fndesc, [code_of(result)])
        return result


def _entry():
    """What a caller's compiler knows code by that has no address: any built-in function that is no other's."""
    return object().__sizeof__


def keep_text(cache) -> None:
    """Have numba's cache of an inner kernel keep its text, which all kernels share that Python calls."""
    cache._impl.reduce, cache._impl.rebuild = _reduced, _rebuilt


def _reduced(result):
    result.fndesc.typemap = result.fndesc.calltypes = None  # of its own compilation alone
    text = code_of(result)._final_module.as_bitcode()
    return text, result.fndesc, result.environment, result.signature


def _rebuilt(target, content):
    text, description, environment, signature = content
    library = _Text(target.codegen(), "inner")
    library._final_module = parse_bitcode(text)
    library._finalized = True
    return compile_result(
        typing_context=target.typing_context, target_context=target, entry_point=_entry(), library=library,
        fndesc=description, environment=environment, signature=signature, objectmode=False, lifted=(),
        typing_error=None, type_annotation="", call_helper=None, metadata=None, reload_init=[], referenced_envs=[],
    )  # fmt: skip


class _Sample(NamedTuple):
    terms: np.ndarray


def try_out(options) -> None:
    """Compile a kernel within another, and keep and take its text; raises whatever numba makes of it."""
    register(_Sample)
    inner = numba.njit(
        lambda sample: sample.terms[0], pipeline_class=Inner, no_cpython_wrapper=True, forceinline=True, _nrt=False,
        **options,
    )  # fmt: skip
    outer = numba.njit(lambda sample: inner(on_stack(sample)), forceinline=True, _nrt=False, **options)
    if outer(_Sample(np.array([2.0]))) != 2.0:
        raise ValueError("numba reads another number")
    (result,) = inner.overloads.values()
    _rebuilt(result.target_context, _reduced(result))
