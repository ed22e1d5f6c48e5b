"""The private names of Numba, llvmlite and numba-cuda that the engine uses."""

from __future__ import annotations

from typing import NamedTuple

from baldwinlab.engine.numba_internals import dispatchers


class Name(NamedTuple):
    """A name of Numba, the purpose in the engine, and arguments such as "self, builder, size="."""

    path: str
    purpose: str
    call: str | None = None


POINTERS = "the address of a field or an item"
MODELS = "the layout of a tuple in memory"
LIBRARY = "optimizing the code of a function"
LINKED = "compiling a function without machine code of its own"
PASSES = "replacing Numba's lowering"
REUSE = "compiling a function once for many combinations of parts"
CACHE = "storing compiled code for the next start"
OPTION = "compiling functions that are inlined and count no references"
BROWSER = "modules for browsers"
CALLS = "calling compiled functions without a look-up of types at each call"
EMIT = "instructions for SIMD blocks and for tuples by their address"
GPU = "kernels with the same bits as on the CPU"

OPTIONS = [*dispatchers.INLINED, *dispatchers.UNWRAPPED]

IMPORTED_NAMES = [
    Name("numba.core.cgutils.gep", POINTERS, "builder, pointer, index"),
    Name("numba.core.cgutils.gep_inbounds", POINTERS, "builder, pointer, index, index"),
    Name("numba.core.cgutils.alloca_once", POINTERS, "builder, kind, size="),
    Name("numba.core.cgutils.alloca_once_value", POINTERS, "builder, value"),
    Name(
        "numba.core.cgutils.get_item_pointer",
        POINTERS,
        "context, builder, kind, array, indices, wraparound=",
    ),
    Name("numba.core.cgutils.get_or_insert_function", EMIT, "module, kind, name"),
    Name("numba.core.datamodel.default_manager.lookup", MODELS, "kind"),
    Name("numba.core.datamodel.models.DataModel.get_data_type", MODELS, "self"),
    Name("numba.core.datamodel.models.DataModel.get_value_type", MODELS, "self"),
    Name("numba.core.datamodel.models.DataModel.as_data", MODELS, "self, builder, value"),
    Name(
        "numba.core.datamodel.models.DataModel.load_from_data_pointer",
        MODELS,
        "self, builder, pointer",
    ),
    Name("numba.core.types.containers.BaseTuple", MODELS),
    Name("numba.core.types.containers.BaseNamedTuple", MODELS),
    Name("numba.core.typing.templates.AttributeTemplate.generic_resolve", MODELS),
    Name("numba.extending.infer_getattr", MODELS, "template"),
    Name("numba.extending.lower_getattr_generic", MODELS, "kind"),
    Name("numba.core.base.BaseContext.cast", EMIT, "self, builder, value, kind, kind"),
    Name("numba.core.base.BaseContext.get_constant", EMIT, "self, kind, value"),
    Name("numba.core.base.BaseContext.get_dummy_value", EMIT, "self"),
    Name("numba.core.base.BaseContext.make_array", EMIT, "self, kind"),
    Name("numba.core.base.BaseContext.make_tuple", EMIT, "self, builder, kind, values"),
    Name("numba.core.base.BaseContext.pack_value", EMIT, "self, builder, kind, value, pointer"),
    Name("numba.core.base.BaseContext.unpack_value", EMIT, "self, builder, kind, pointer"),
    Name("numba.core.runtime.nrt.rtsys.initialize", CACHE, "context"),
    Name(
        "numba.core.base.BaseContext.insert_user_function",
        REUSE,
        "self, function, description, libraries",
    ),
    Name("numba.core.cpu.CPUContext.codegen", LIBRARY, "self"),
    Name("numba.core.codegen.CPUCodegen.magic_tuple", CACHE, "self"),
    Name("numba.core.codegen.CPUCodeLibrary.serialize_using_bitcode", CACHE, "self"),
    Name("numba.core.codegen.CPUCodegen._module_pass_manager", LINKED, "self, opt=, cost="),
    Name("numba.core.codegen.JITCodeLibrary", LIBRARY, "codegen, name"),
    Name("numba.core.codegen.JITCodeLibrary._optimize_functions", LIBRARY, "self, module"),
    Name("numba.core.codegen.JITCodeLibrary._optimize_final_module", LIBRARY, "self"),
    Name("numba.core.codegen.JITCodeLibrary._finalize_final_module", LINKED, "self"),
    Name("numba.core.codegen.JITCodeLibrary._finalize_dynamic_globals", LINKED, "self"),
    Name("numba.core.codegen.JITCodeLibrary._ensure_finalized", LINKED, "self"),
    Name("numba.core.codegen.JITCodeLibrary.get_pointer_to_function", LINKED, "self, name"),
    Name("numba.core.codegen.JITCodeLibrary.codegen", LINKED),
    Name("numba.core.codegen.JITCPUCodegen.set_env", LINKED, "self, name, environment"),
    Name("numba.core.codegen.JITCodeLibrary.enable_object_caching", CACHE, "self"),
    Name("numba.core.codegen.JITCodeLibrary.get_llvm_str", BROWSER, "self"),
    Name("numba.core.compiler.CompilerBase.compile_extra", REUSE, "self, function"),
    Name("numba.core.compiler.CompilerBase.define_pipelines", PASSES, "self"),
    Name("numba.core.compiler.DefaultPassBuilder.define_nopython_pipeline", PASSES, "state"),
    Name("numba.core.compiler.CompileResult._reduce", CACHE, "self"),
    Name("numba.core.compiler.CompileResult._rebuild", CACHE, "context" + ", data" * 9),
    Name("numba.core.compiler.CompileResult._replace", REUSE, "self, signature=, fndesc="),
    Name("numba.core.compiler_machinery.PassManager", PASSES, "name"),
    Name("numba.core.compiler_machinery.PassManager.add_pass", PASSES, "self, pass, description"),
    Name("numba.core.compiler_machinery.PassManager.finalize", PASSES, "self"),
    Name("numba.core.compiler_machinery.register_pass", PASSES, "mutates_CFG=, analysis_only="),
    Name("numba.core.typed_passes.NativeLowering._name", PASSES),
    Name("numba.core.typed_passes.NativeLowering.run_pass", PASSES, "self, state"),
    Name("numba.core.typing.signature", REUSE, "kind, kind, kind"),
    Name("numba.core.serialize.dumps", CACHE, "data"),
    Name("numba.core.errors.NumbaError", "one sentence about a part that cannot be compiled"),
    Name("numba.core.dispatcher.Dispatcher.typeof_pyval", CALLS, "self, value"),
    Name("numba.core.dispatcher.Dispatcher.get_overload", CALLS, "self, types"),
    Name("numba.core.dispatcher.Dispatcher.compile", CALLS, "self, types"),
    Name("numba.core.decorators.jit", PASSES, "pipeline_class="),
    *(Name(f"numba.core.cpu.CPUTargetOptions.{option}", OPTION) for option in OPTIONS),
    Name("llvmlite.binding.create_pipeline_tuning_options", LIBRARY, "level"),
    Name("llvmlite.binding.create_pass_builder", LIBRARY, "machine, options"),
    Name("llvmlite.binding.PipelineTuningOptions.loop_unrolling", LIBRARY),
    Name("llvmlite.binding.PassBuilder.getModulePassManager", LIBRARY, "self"),
    Name("llvmlite.binding.PassBuilder.getFunctionPassManager", LIBRARY, "self"),
    Name("llvmlite.binding.ModulePassManager.run", LIBRARY, "self, module, builder"),
    Name("llvmlite.binding.FunctionPassManager.run", LIBRARY, "self, function, builder"),
    Name("llvmlite.binding.ModuleRef.data_layout", LIBRARY),
    Name("llvmlite.binding.ModuleRef.functions", LIBRARY),
    Name("llvmlite.binding.TargetMachine.emit_object", CACHE, "self, module"),
    Name("llvmlite.binding.parse_bitcode", CACHE, "content"),
    Name("llvmlite.ir.FunctionType", EMIT, "return_type, argument_types"),
    Name("llvmlite.ir.IRBuilder.module", EMIT),
    Name("llvmlite.ir.IntType.as_pointer", MODELS, "self"),
    Name("numba.core.config.OPT", LIBRARY),
]

COMPILATION_NAMES = [
    Name("library._codegen", LIBRARY),
    Name("library._codegen._tm", LIBRARY),
    Name("library._codegen._data_layout", LIBRARY),
    Name("library._final_module", LIBRARY),
    Name("library._finalized", LINKED),
    Name("library._linking_libraries", LINKED),
    Name("state.pipeline", PASSES),
    Name("state.targetctx.codegen", PASSES),
    Name("state.func_id.func_qualname", PASSES),
    Name("state.library", PASSES),
    Name("state.args", REUSE),
    Name("state.typemap", REUSE),
    Name("state.calltypes", REUSE),
    Name("state.func_ir.blocks", REUSE),
    Name("block.find_exprs", REUSE, "operation"),
    Name("expression.value.name", REUSE),
    Name("expression.attr", REUSE),
    Name("call.args", REUSE),
    Name("call.return_type", REUSE),
    Name("passes.passes", PASSES),
    Name("result.library", REUSE),
    Name("result.entry_point", REUSE),
    Name("result.signature", REUSE),
    Name("result.fndesc", REUSE),
    Name("result.metadata", REUSE),
    Name("result.codegen", CACHE),
    Name("result.fndesc.argtypes", REUSE),
    Name("result.fndesc.llvm_func_name", BROWSER),
    Name("dispatcher._cache", CACHE),
    Name("dispatcher.overloads", BROWSER),
    Name("dispatcher._cache.cache_path", CACHE),
    Name("state.targetctx.data_model_manager", MODELS),
    Name("array.data", EMIT),
    Name("array.itemsize", GPU),
    Name("array.shape", GPU),
    Name("array.strides", GPU),
    Name("tuple_type.instance_class", MODELS),
    Name("tuple_type.fields", MODELS),
    Name("tuple_type.types", MODELS),
]

CUDA_NAMES = [
    Name("numba.cuda.cudadrv.nvvm.compile_ir", GPU, "code, fma="),
    Name("numba.cuda.core.config.CUDA_LOW_OCCUPANCY_WARNINGS", GPU),
    Name("numba.cuda.extending.intrinsic", GPU, "function"),
    Name("numba.cuda.extending.overload", GPU, "function, strict="),
    Name("numba.cuda.cgutils.unpack_tuple", GPU, "builder, values"),
    Name("numba.cuda.cgutils._StructProxy._getvalue", GPU, "self"),
    Name("numba.cuda.types.intp", GPU),
    Name("numba.cuda.target.CUDATargetContext.make_array", GPU, "self, kind"),
    Name("numba.cuda.target.CUDATargetContext.get_constant", GPU, "self, kind, value"),
    Name(
        "numba.cuda.target.CUDATargetContext.populate_array",
        GPU,
        "self, array, data=, shape=, strides=, itemsize=, meminfo=",
    ),
    Name("numba.cuda.dispatcher.CUDADispatcher.compile", CACHE, "self, types"),
    Name("numba.cuda.dispatcher.CUDADispatcher.configure", CALLS, "self, blocks, threads, stream"),
    Name("numba.cuda.dispatcher.CUDADispatcher.typeof_pyval", CALLS, "self, value"),
    Name("numba.cuda.dispatcher._Kernel.launch", CALLS, "self, arguments, blocks, threads, stream"),
    *(Name(f"configuration.{name}", CALLS) for name in ("griddim", "blockdim", "stream")),
    Name("configuration.dispatcher.targetoptions", CACHE),
    Name("numba.cuda.dispatcher._Kernel.codegen", CACHE),
    Name("numba.cuda.dispatcher._Kernel._reduce_states", CACHE, "self"),
    Name("numba.cuda.dispatcher._Kernel._rebuild", CACHE),
    Name("numba.cuda.codegen.CUDACodeLibrary._reduce_states", CACHE, "self"),
    Name("numba.cuda.codegen.CUDACodeLibrary._rebuild", CACHE),
    Name("numba.cuda.codegen.JITCUDACodegen.magic_tuple", CACHE, "self"),
    Name("numba.cuda.serialize.dumps", CACHE, "data"),
]


NAMES = [*IMPORTED_NAMES, *COMPILATION_NAMES, *CUDA_NAMES]
