/* OpenGL 3.3 core as one table of entry points, found by name at run time. No GL library is linked: libGL and
 * libOSMesa define the same symbols and cannot live in one process otherwise. */
#ifndef SKIFF_GL_H
#define SKIFF_GL_H

#include "engine/base/err.h"

#include <GL/glcorearb.h>

/* The one list: X(NAME IN THE TYPE, NameInTheTable). */
#define GL_ENTRY_POINTS(X)                                                                                   \
    X(ACTIVETEXTURE, ActiveTexture)                                                                          \
    X(ATTACHSHADER, AttachShader)                                                                            \
    X(BINDBUFFER, BindBuffer)                                                                                \
    X(BINDBUFFERBASE, BindBufferBase)                                                                        \
    X(BINDFRAMEBUFFER, BindFramebuffer)                                                                      \
    X(BINDTEXTURE, BindTexture)                                                                              \
    X(BINDVERTEXARRAY, BindVertexArray)                                                                      \
    X(BLENDEQUATION, BlendEquation)                                                                          \
    X(BLENDFUNC, BlendFunc)                                                                                  \
    X(BUFFERDATA, BufferData)                                                                                \
    X(CHECKFRAMEBUFFERSTATUS, CheckFramebufferStatus)                                                        \
    X(CLEARBUFFERFV, ClearBufferfv)                                                                          \
    X(COLORMASK, ColorMask)                                                                                  \
    X(COMPILESHADER, CompileShader)                                                                          \
    X(CREATEPROGRAM, CreateProgram)                                                                          \
    X(CREATESHADER, CreateShader)                                                                            \
    X(CULLFACE, CullFace)                                                                                    \
    X(DELETEBUFFERS, DeleteBuffers)                                                                          \
    X(DELETEFRAMEBUFFERS, DeleteFramebuffers)                                                                \
    X(DELETEPROGRAM, DeleteProgram)                                                                          \
    X(DELETESHADER, DeleteShader)                                                                            \
    X(DELETETEXTURES, DeleteTextures)                                                                        \
    X(DELETEVERTEXARRAYS, DeleteVertexArrays)                                                                \
    X(DEPTHMASK, DepthMask)                                                                                  \
    X(DISABLE, Disable)                                                                                      \
    X(DRAWARRAYS, DrawArrays)                                                                                \
    X(DRAWBUFFERS, DrawBuffers)                                                                              \
    X(ENABLE, Enable)                                                                                        \
    X(ENABLEVERTEXATTRIBARRAY, EnableVertexAttribArray)                                                      \
    X(FINISH, Finish)                                                                                        \
    X(FRAMEBUFFERTEXTURE2D, FramebufferTexture2D)                                                            \
    X(FRONTFACE, FrontFace)                                                                                  \
    X(GENBUFFERS, GenBuffers)                                                                                \
    X(GENERATEMIPMAP, GenerateMipmap)                                                                        \
    X(GENFRAMEBUFFERS, GenFramebuffers)                                                                      \
    X(GENTEXTURES, GenTextures)                                                                              \
    X(GENVERTEXARRAYS, GenVertexArrays)                                                                      \
    X(GETERROR, GetError)                                                                                    \
    X(GETINTEGERV, GetIntegerv)                                                                              \
    X(GETPROGRAMINFOLOG, GetProgramInfoLog)                                                                  \
    X(GETPROGRAMIV, GetProgramiv)                                                                            \
    X(GETSHADERINFOLOG, GetShaderInfoLog)                                                                    \
    X(GETSHADERIV, GetShaderiv)                                                                              \
    X(GETSTRING, GetString)                                                                                  \
    X(GETUNIFORMBLOCKINDEX, GetUniformBlockIndex)                                                            \
    X(GETUNIFORMLOCATION, GetUniformLocation)                                                                \
    X(LINKPROGRAM, LinkProgram)                                                                              \
    X(PIXELSTOREI, PixelStorei)                                                                              \
    X(READPIXELS, ReadPixels)                                                                                \
    X(SCISSOR, Scissor)                                                                                      \
    X(SHADERSOURCE, ShaderSource)                                                                            \
    X(TEXIMAGE2D, TexImage2D)                                                                                \
    X(TEXPARAMETERI, TexParameteri)                                                                          \
    X(UNIFORM1F, Uniform1f)                                                                                  \
    X(UNIFORM1I, Uniform1i)                                                                                  \
    X(UNIFORM2F, Uniform2f)                                                                                  \
    X(UNIFORM2I, Uniform2i)                                                                                  \
    X(UNIFORM3FV, Uniform3fv)                                                                                \
    X(UNIFORM4FV, Uniform4fv)                                                                                \
    X(UNIFORMBLOCKBINDING, UniformBlockBinding)                                                              \
    X(UNIFORMMATRIX4FV, UniformMatrix4fv)                                                                    \
    X(USEPROGRAM, UseProgram)                                                                                \
    X(VERTEXATTRIBPOINTER, VertexAttribPointer)                                                              \
    X(VIEWPORT, Viewport)

typedef struct Gl {
#define X(type, name) PFNGL##type##PROC name;
    GL_ENTRY_POINTS(X)
#undef X
} Gl;

typedef void (*GlProc)(void);
typedef GlProc (*GlGetProc)(const char *name);

/* ERR_GL with the names of the entry points that are missing. */
bool gl_load(Gl *gl, GlGetProc get_proc, Err *err);

/* False (ERR_GL) when GL has recorded an error since the last call; `where` goes into the message. */
bool gl_check(const Gl *gl, const char *where, Err *err);

#endif
