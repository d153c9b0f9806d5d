import time, numpy as np
import omnidyn
from omnidyn.simulation.batch.parameters import *
from omnidyn.simulation.batch.exact import *
from omnidyn.simulation.batch.march import *
robot=omnidyn.load_robot('axebot')
N,T=1024,2000
p=batch_parameters([robot]*N)
s=1+.2*np.random.default_rng(0).uniform(-1,1,(4,N))
p=p._replace(mass=p.mass*s[0],damping=p.damping*s[1],coulomb=p.coulomb*s[2],breakaway=p.breakaway*s[2]*1.2)
U=6*np.sin(np.arange(T)[:,None]*1e-3*np.array([8,13,23.]))
for own in (0,1):
 for stats in (0,1):
  for kind in (np.float64,np.float32):
    laws=in_blocks(exact_law(p,1e-3),kind); B=len(laws); states=np.zeros((B,3,WIDTH),kind)
    u=U.astype(kind)[None,:,:,None]
    if own: u=np.ascontiguousarray(np.broadcast_to(u,(B,T,3,WIDTH)))
    rows=Rows(u,states,np.full((B,WIDTH),T)); rec=Record(0,np.zeros((0,3,0),kind),np.zeros((B if stats else 0,12,WIDTH)))
    t=time.perf_counter(); march_twist(0,B,laws,rows,rec); print('first',time.perf_counter()-t)
    best=9
    for _ in range(8):
        t=time.process_time(); march_twist(0,B,laws,rows,rec); best=min(best,time.process_time()-t)
    print('own' if own else 'shared','stats' if stats else '',kind.__name__, best/N/T*1e9,'ns')
